#include "server/convert/convert_target.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace halflight {
namespace {

constexpr Interval kError{.low = 0.0, .high = 1.0, .open_low = true};

bool ShowsLayers(const OutputJob& output) { return output.shown.kind == ImageKind::kLightLayers; }

}  // namespace

void CheckTarget(const v1::RenderFrameRequest& request, FieldChecks& checks) {
  const v1::Target& target = request.target();
  if (!target.has_max_error() && !target.has_max_time_ms()) {
    checks.Reject("target", "neither max_error nor max_time_ms", "one of them or both");
  }
  if (target.has_max_error()) {
    checks.InRange("target.max_error", target.max_error(), kError);
  }
  if (target.has_max_time_ms()) {
    checks.InRange("target.max_time_ms", target.max_time_ms(), kPositive);
  }
  if (request.scene().has_shadow()) {
    checks.Reject("scene.shadow", "set", "unset beside a target, which chooses it");
  }
}

TargetJob ConvertTarget(const v1::RenderFrameRequest& request, const Scene& scene, int samples,
                        const ServerLimits& limits, OutputPlan& plan) {
  TargetJob job;
  if (request.target().has_max_error()) {
    job.goal.max_error = request.target().max_error();
  }
  if (request.target().has_max_time_ms()) {
    job.goal.max_time_ms = request.target().max_time_ms();
  }
  job.goal.samples = samples;

  // From all that the server has, down to what the outputs may hold.
  Scene largest = scene;
  int& slices = largest.shadow.slices;
  int& size = largest.shadow.light_buffer_size;
  slices = static_cast<int>(limits.max_slices);
  size = static_cast<int>(limits.max_light_buffer_size);
  const bool layers = std::any_of(plan.outputs.begin(), plan.outputs.end(), ShowsLayers);
  while (PixelBytes(plan.outputs, largest) > limits.max_output_bytes) {
    int& larger = layers && slices > size ? slices : size;
    larger = std::max(1, larger / 2);
  }
  plan.pixel_bytes = PixelBytes(plan.outputs, largest);

  job.limits.max_reference_work = static_cast<double>(limits.max_reference_work);
  job.limits.max_slices = slices;
  job.limits.max_light_buffer_size = size;
  job.limits.may_downsample = !request.scene().has_sampling();

  const double samples_a_pixel = 1.0 * scene.sampling.supersample * scene.sampling.supersample;
  const double particles = std::max(1.0, static_cast<double>(scene.particles->size()));
  job.max_samples =
      static_cast<int>(std::clamp(job.limits.max_reference_work / (samples_a_pixel * particles),
                                  1.0 * samples, 1.0 * std::numeric_limits<int>::max()));
  job.knowledge = std::make_shared<TargetKnowledge>();
  return job;
}

v1::Target DescribeTarget(const TargetGoal& goal) {
  v1::Target described;
  if (goal.max_error.has_value()) {
    described.set_max_error(*goal.max_error);
  }
  if (goal.max_time_ms.has_value()) {
    described.set_max_time_ms(*goal.max_time_ms);
  }
  return described;
}

}  // namespace halflight
