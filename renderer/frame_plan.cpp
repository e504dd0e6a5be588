#include "renderer/frame_plan.h"

#include <algorithm>

#include "renderer/frame.h"
#include "renderer/light_buffer_size.h"
#include "renderer/shadow_technique.h"

namespace halflight {

namespace {

void DescribeSampling(const Sampling& sampling, FramePlan& plan) {
  if (sampling.supersample > 1) {
    plan.passes.push_back({"average samples", "supersample above 1", 1});
  }
  if (sampling.downsample > 1) {
    plan.passes.push_back({"enlarge samples", "downsample above 1", 1});
  }
}

}  // namespace

glm::ivec2 CompositeSize(const PixelRect& window, const Sampling& sampling) {
  const glm::ivec2 pixels(window.width, window.height);
  return (pixels * sampling.supersample + (sampling.downsample - 1)) / sampling.downsample;
}

Traversal PlanLightBuffer(const Scene& scene, const ParticleView& particles, int light) {
  Traversal traversal;
  traversal.shadow_light = light;
  traversal.slices = static_cast<int>(
      std::clamp<size_t>(particles.size(), 1, static_cast<size_t>(scene.shadow.slices)));
  traversal.spacing = scene.shadow.spacing;
  traversal.light_buffer_size = LightBufferSizeFor(scene, particles);
  traversal.blur = scene.scatters();
  traversal.keep_unscattered = traversal.blur && scene.material.physical_scattering;
  traversal.colored_light_buffer =
      traversal.blur && scene.lights[static_cast<size_t>(light)].colored_density();
  return traversal;
}

absl::StatusOr<FramePlan> PlanFrame(const FrameRequest& request, const ParticleView& particles) {
  const Scene& scene = request.scene;
  for (const ImageRequest& image : request.images) {
    if (image.kind == ImageKind::kError) {
      return absl::InvalidArgumentError(
          "outputs: error, allowed of the renderer: what is drawn; the error is made of a beauty");
    }
  }
  FramePlan plan;
  plan.window_size = {scene.camera.window.width, scene.camera.window.height};
  plan.composite_size = CompositeSize(scene.camera.window, scene.sampling);
  plan.keep_depth = Shows(request, ImageKind::kDepth);
  const ShadowTechnique& technique = TechniqueFor(scene.shadow.technique);
  if (absl::Status status = technique.Check(request); !status.ok()) return status;
  plan.light_buffer_size = LightBufferSizeFor(scene, particles);
  if (absl::Status status = technique.Plan(request, particles, plan); !status.ok()) return status;
  DescribeSampling(scene.sampling, plan);
  return plan;
}

}  // namespace halflight
