// Uses what generated stubs use: gRPC has no other blocking calls for messages in bytes.
#include "client/frame_calls.h"

#include <string>

#include "halflight/v1/service.grpc.pb.h"

namespace halflight::client {

namespace {

using grpc::internal::RpcMethod;

std::string PathOf(const char* rpc) {
  return std::string("/") + v1::RenderService::service_full_name() + "/" + rpc;
}

}  // namespace

std::unique_ptr<FrameStream> CallRenderFrame(grpc::ChannelInterface& channel,
                                             grpc::ClientContext& context,
                                             const v1::RenderFrameRequest& request) {
  const std::string path = PathOf("RenderFrame");
  return std::unique_ptr<FrameStream>(grpc::internal::ClientReaderFactory<grpc::ByteBuffer>::Create(
      &channel, RpcMethod(path.c_str(), RpcMethod::SERVER_STREAMING), &context, request));
}

std::unique_ptr<SequenceStream> CallRenderSequence(grpc::ChannelInterface& channel,
                                                   grpc::ClientContext& context) {
  const std::string path = PathOf("RenderSequence");
  using Factory =
      grpc::internal::ClientReaderWriterFactory<v1::RenderSequenceRequest, grpc::ByteBuffer>;
  return std::unique_ptr<SequenceStream>(
      Factory::Create(&channel, RpcMethod(path.c_str(), RpcMethod::BIDI_STREAMING), &context));
}

}  // namespace halflight::client
