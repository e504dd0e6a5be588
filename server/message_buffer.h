// Outgoing messages as gRPC sends them: the bytes that Protobuf would write, but with a chunk's
// data where it lies instead of copied. Knows nothing of calls.
#pragma once

#include <string>

#include <grpcpp/support/byte_buffer.h>

#include "halflight/v1/frame.pb.h"
#include "server/handlers/sink.h"

namespace halflight {

// All that comes before a chunk's data in a message: `rest` is the message without its chunk,
// serialised, which Protobuf writes first, and `chunk_field` the number of its field.
std::string BytesBeforeData(std::string rest, int chunk_field, const v1::OutputChunk& chunk,
                            size_t data_bytes);

// Two slices, of which the second is the data and keeps it alive.
grpc::ByteBuffer JoinWithoutCopying(const std::string& before, const SharedBytes& data);

// RenderFrameResponse and RenderSequenceResponse, whose chunks have their highest set field number.
template <typename Response>
grpc::ByteBuffer ToByteBuffer(const OutgoingMessage<Response>& outgoing) {
  const Response& message = outgoing.message;
  if (!message.has_chunk()) {
    return JoinWithoutCopying(message.SerializeAsString(), {});
  }
  Response rest = message;
  rest.clear_chunk();
  return JoinWithoutCopying(BytesBeforeData(rest.SerializeAsString(), Response::kChunkFieldNumber,
                                            message.chunk(), outgoing.chunk_data.size()),
                            outgoing.chunk_data);
}

}  // namespace halflight
