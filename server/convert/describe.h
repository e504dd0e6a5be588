// What is told of a finished frame: the header that precedes it and the attributes inside its
// images. Makes nothing up: all of it comes from the job and the renderer's result.
#pragma once

#include <string>
#include <vector>

#include "halflight/v1/frame.pb.h"
#include "renderer/frame_engine.h"
#include "server/convert/convert_frame.h"
#include "server/encode/encode.h"
#include "server/made_frame.h"

namespace halflight {

// Metadata for one output. Holds nothing that differs between equal requests but what a target
// chose, so that equal settings give equal files.
ImageMetadata DescribeImage(const FrameJob& job, const MadeFrame& frame, const OutputJob& output,
                            const DeviceInfo& device, const std::string& server_version);

// `encoded` has one element for each of the job's outputs.
v1::FrameHeader DescribeFrame(const FrameJob& job, const MadeFrame& frame,
                              const std::vector<EncodedImage>& encoded, const DeviceInfo& device,
                              const std::string& server_version);

}  // namespace halflight
