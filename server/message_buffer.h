// Messages as gRPC has them, in bytes: incoming ones within bounds, and outgoing ones as Protobuf
// would write them, but with a chunk's data where it lies instead of copied. Knows nothing of
// calls.
#pragma once

#include <cstddef>
#include <string>

#include <google/protobuf/message.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>

#include "absl/status/statusor.h"
#include "halflight/v1/frame.pb.h"
#include "halflight/v1/particles.pb.h"
#include "halflight/v1/service.pb.h"
#include "server/handlers/sink.h"

namespace halflight {

// What a message may take in memory beside the particles that it carries. An empty one in a list is
// sent as two bytes, and takes some sixty once it is read.
constexpr size_t kMaxReadBytes = size_t{256} << 10U;

// Of particles that a request carries.
inline size_t CarriedBytes(const google::protobuf::Message& /*other*/) { return 0; }
inline size_t CarriedBytes(const v1::RenderFrameRequest& request) {
  return request.scene().inline_particles().payload().capacity();
}
inline size_t CarriedBytes(const v1::RenderSequenceRequest& request) {
  return CarriedBytes(request.frame());
}
inline size_t CarriedBytes(const v1::UploadParticlesRequest& request) {
  return request.chunk().capacity();
}

absl::Status UnreadableMessage(const google::protobuf::Message& wanted);
absl::Status ExcessiveMessage(size_t read_bytes);

// The message that the bytes are, which are let go of. InvalidArgument where they are none, or one
// that takes more memory than it may.
template <typename Message>
absl::StatusOr<Message> TakeMessage(grpc::ByteBuffer& bytes) {
  Message message;
  if (!grpc::SerializationTraits<Message>::Deserialize(&bytes, &message).ok()) {
    return UnreadableMessage(message);
  }
  const size_t read_bytes = message.SpaceUsedLong();
  if (read_bytes > kMaxReadBytes + CarriedBytes(message)) {
    return ExcessiveMessage(read_bytes);
  }
  return message;
}

// All that comes before a chunk's data in a message: `rest` is the message without its chunk,
// serialised, which Protobuf writes first, and `chunk_field` the number of its field.
std::string BytesBeforeData(std::string rest, int chunk_field, const v1::OutputChunk& chunk,
                            size_t data_bytes);

// Two slices, of which the second is the data and keeps it alive.
grpc::ByteBuffer JoinWithoutCopying(const std::string& before, const SharedBytes& data);

inline grpc::ByteBuffer ToByteBuffer(const google::protobuf::Message& message) {
  return JoinWithoutCopying(message.SerializeAsString(), {});
}

// RenderFrameResponse and RenderSequenceResponse, whose chunks have their highest set field number.
template <typename Response>
grpc::ByteBuffer ToByteBuffer(const OutgoingMessage<Response>& outgoing) {
  const Response& message = outgoing.message;
  if (!message.has_chunk()) {
    return ToByteBuffer(message);
  }
  Response rest = message;
  rest.clear_chunk();
  return JoinWithoutCopying(BytesBeforeData(rest.SerializeAsString(), Response::kChunkFieldNumber,
                                            message.chunk(), outgoing.chunk_data.size()),
                            outgoing.chunk_data);
}

}  // namespace halflight
