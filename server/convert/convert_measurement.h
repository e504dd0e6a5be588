// What is to be measured of a frame, from the request's measure_error, its outputs of the error and
// the error that its target allows, with every check of it. Measures nothing.
#pragma once

#include <cstddef>
#include <optional>

#include "halflight/v1/service.pb.h"
#include "renderer/error_estimate.h"
#include "renderer/scene.h"
#include "server/convert/convert_outputs.h"
#include "server/convert/field_checks.h"
#include "server/limits.h"

namespace halflight {

struct MeasureJob {
  // As asked for; with a target of an error, to begin with. None where only a map is.
  std::optional<ErrorEstimateOptions> sample;
  bool map = false;  // an output shows the error at every pixel
  // Whether the frame that is compared is another one: the same without scattering.
  bool without_scattering = false;
  size_t beauty = 0;  // else which of the frame's images is compared
};

// None where nothing is asked for. Completes `plan`: adds the beauty where it is compared and no
// output shows it, and gives outputs of the error their image, which comes after all that are
// rendered. The scene and the plan have passed their checks. Field paths start with
// "measure_error", "target" or "outputs".
std::optional<MeasureJob> ConvertMeasurement(const v1::RenderFrameRequest& request,
                                             const Scene& scene, const ServerLimits& limits,
                                             OutputPlan& plan, FieldChecks& checks);

// As asked for, defaults filled in.
v1::ErrorMeasurement DescribeMeasurement(const ErrorEstimateOptions& sample);

}  // namespace halflight
