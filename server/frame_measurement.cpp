#include "server/frame_measurement.h"

#include <chrono>
#include <utility>

#include "renderer/error_map.h"

namespace halflight {

FrameRequest WithoutScattering(const FrameRequest& request) {
  FrameRequest compared{request.scene, {{ImageKind::kBeauty}}};
  compared.scene.material.scattering_spread = 0.0F;
  compared.scene.material.physical_scattering.reset();
  compared.scene.shadow.blur_mode = BlurMode::kDistance;
  compared.scene.shadow.blur_texels = 0.0F;
  return compared;
}

absl::StatusOr<FrameError> FrameMeasurer::operator()(const Image& beauty, const Scene& scene,
                                                     const MeasureJob& job,
                                                     const std::stop_token& stop) const {
  if (!job.map) {
    absl::StatusOr<ErrorEstimate> estimate =
        EstimateError(beauty, scene, *job.sample, stop, indexes_.get());
    if (!estimate.ok()) {
      return estimate.status();
    }
    return FrameError{*std::move(estimate), std::nullopt};
  }
  const auto begin = std::chrono::steady_clock::now();
  absl::StatusOr<Image> map = ErrorMap(beauty, scene, stop, indexes_.get());
  if (!map.ok()) {
    return map.status();
  }
  ErrorEstimate estimate = ErrorOf(beauty, *map);
  estimate.milliseconds =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return FrameError{std::move(estimate), *std::move(map)};
}

}  // namespace halflight
