#include "server/convert/convert_measurement.h"

#include <algorithm>

#include <fmt/format.h>

#include "server/convert/scene_checks.h"

namespace halflight {
namespace {

constexpr Interval kSamples{.low = 32.0, .high = 1048576.0};

ErrorEstimateOptions ConvertSample(const v1::ErrorMeasurement& measurement, FieldChecks& checks) {
  ErrorEstimateOptions sample;
  const auto unset = static_cast<uint32_t>(sample.samples);
  sample.samples = static_cast<int>(
      checks.InRangeOr("measure_error.samples", measurement.samples(), unset, kSamples));
  sample.seed = measurement.seed();
  return sample;
}

bool ShowsError(const OutputJob& output) { return output.shown.kind == ImageKind::kError; }

}  // namespace

std::optional<MeasureJob> ConvertMeasurement(const v1::RenderFrameRequest& request,
                                             const Scene& scene, const ServerLimits& limits,
                                             OutputPlan& plan, FieldChecks& checks) {
  MeasureJob job;
  job.without_scattering = scene.scatters();
  if (request.has_measure_error()) {
    job.sample = ConvertSample(request.measure_error(), checks);
  } else if (request.target().has_max_error()) {
    job.sample = ConvertSample({}, checks);
  }
  const auto map = std::find_if(plan.outputs.begin(), plan.outputs.end(), ShowsError);
  job.map = map != plan.outputs.end();
  if (!job.sample.has_value() && !job.map) {
    return std::nullopt;
  }
  if (!job.without_scattering) {
    job.beauty = IndexOfImage(plan.images, {ImageKind::kBeauty});
  }
  for (OutputJob& output : plan.outputs) {
    if (ShowsError(output)) {
      output.image = plan.images.size();
    }
  }

  const double pixels = static_cast<double>(scene.camera.window.width) * scene.camera.window.height;
  if (job.map) {
    CheckReferenceWork(fmt::format("outputs[{}].kind", map - plan.outputs.begin()),
                       "OUTPUT_KIND_ERROR", pixels, scene, limits, checks);
  } else {
    CheckReferenceWork(request.has_measure_error() ? "measure_error" : "target.max_error",
                       "a measurement", std::min(pixels, static_cast<double>(job.sample->samples)),
                       scene, limits, checks);
  }
  return job;
}

v1::ErrorMeasurement DescribeMeasurement(const ErrorEstimateOptions& sample) {
  v1::ErrorMeasurement described;
  described.set_samples(static_cast<uint32_t>(sample.samples));
  described.set_seed(sample.seed);
  return described;
}

}  // namespace halflight
