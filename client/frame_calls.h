// The calls that frames come over, as the generated stub makes them, but for what comes: it stays
// in bytes, so that frame_reader.h can read it without copying.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>

#include "halflight/v1/service.pb.h"

namespace halflight::client {

using FrameStream = grpc::ClientReader<grpc::ByteBuffer>;
using SequenceStream = grpc::ClientReaderWriter<v1::RenderSequenceRequest, grpc::ByteBuffer>;

std::unique_ptr<FrameStream> CallRenderFrame(grpc::ChannelInterface& channel,
                                             grpc::ClientContext& context,
                                             const v1::RenderFrameRequest& request);
std::unique_ptr<SequenceStream> CallRenderSequence(grpc::ChannelInterface& channel,
                                                   grpc::ClientContext& context);

}  // namespace halflight::client
