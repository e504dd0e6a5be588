// What is told of a finished frame: the header that precedes it and the attributes inside its
// images. Makes nothing up: all of it comes from the job and the renderer's result.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "halflight/v1/frame.pb.h"
#include "renderer/error_estimate.h"
#include "renderer/frame.h"
#include "renderer/frame_engine.h"
#include "server/convert/convert_frame.h"
#include "server/encode/encode.h"

namespace halflight {

// In both, `error` is there where the job has a measurement.

// Metadata for one output. Holds nothing that differs between equal requests, so that equal
// requests give equal files.
ImageMetadata DescribeImage(const FrameJob& job, const FrameResult& result,
                            const std::optional<ErrorEstimate>& error, const OutputJob& output,
                            const DeviceInfo& device, const std::string& server_version);

// `encoded` has one element for each of the job's outputs.
v1::FrameHeader DescribeFrame(const FrameJob& job, const FrameResult& result,
                              const std::optional<ErrorEstimate>& error,
                              const std::vector<EncodedImage>& encoded,
                              const std::vector<StageTiming>& timings, const DeviceInfo& device,
                              const std::string& server_version);

}  // namespace halflight
