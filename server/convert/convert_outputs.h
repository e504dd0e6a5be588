// The outputs asked for: which images they need and how each is encoded, with every check of their
// settings. Knows nothing of pixels.
#pragma once

#include <cstdint>
#include <vector>

#include <google/protobuf/repeated_ptr_field.h>

#include "halflight/v1/frame.pb.h"
#include "renderer/image.h"
#include "renderer/scene.h"
#include "server/convert/field_checks.h"
#include "server/encode/encode.h"
#include "server/limits.h"

namespace halflight {

// One output of a frame, defaults filled in.
struct OutputJob {
  ImageRequest shown;
  // Which of FrameRequest::images, or their number: the error, which is made of them. Outputs that
  // show the same share one.
  size_t image = 0;
  EncodeSettings encoding{ImageFormat::kPng8};
};

struct OutputPlan {
  std::vector<OutputJob> outputs;  // in the request's order
  std::vector<ImageRequest> images;
  uint64_t pixel_bytes = 0;  // of all outputs together, in 32-bit float, at most
};

// The scene has passed its checks. Field paths start with "outputs". Outputs of the error have no
// image yet: ConvertMeasurement gives it.
OutputPlan ConvertOutputs(const google::protobuf::RepeatedPtrField<v1::Output>& outputs,
                          const Scene& scene, const ServerLimits& limits, FieldChecks& checks);

// The place of an image among `images`, added where it is not there.
size_t IndexOfImage(std::vector<ImageRequest>& images, const ImageRequest& wanted);

// Whether the image shows a light's view of the particles, not the camera's.
bool IsSeenFromLight(ImageKind kind);

// Of all outputs together, in 32-bit float. An upper bound: the renderer may find that fewer slices
// or channels do.
uint64_t PixelBytes(const std::vector<OutputJob>& outputs, const Scene& scene);

// The other way.
v1::Output DescribeOutput(const OutputJob& job);

}  // namespace halflight
