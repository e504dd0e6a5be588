// Reads the messages that frames come in, leaving the data of chunks where gRPC put it: what is
// copied is copied once, to where it belongs. Knows nothing of how messages make a frame.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "halflight/v1/service.pb.h"

namespace halflight::client {

// A RenderFrameResponse or RenderSequenceResponse.
template <typename Response>
struct IncomingMessage {
  Response message;
  // The data of message.chunk(), which may be empty there; valid while the bytes that were read and
  // this message stay as they are.
  std::vector<std::string_view> chunk_data;
};

// DATA_LOSS where the bytes are no such message. Any order of fields, repeated or unknown ones mean
// what they mean to Protobuf; only those that halflightd writes are read without copying the data.
template <typename Response>
absl::Status Read(grpc::ByteBuffer& bytes, IncomingMessage<Response>& incoming);

}  // namespace halflight::client
