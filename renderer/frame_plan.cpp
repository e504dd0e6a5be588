#include "renderer/frame_plan.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "renderer/frame.h"
#include "renderer/projection.h"
#include "renderer/reference_frame.h"
#include "renderer/shadow_technique.h"
#include "renderer/sweep/sweep_frame.h"

namespace halflight {

namespace {

glm::ivec2 CompositeSize(const PixelRect& window, const Sampling& sampling) {
  const glm::ivec2 pixels(window.width, window.height);
  return (pixels * sampling.supersample + (sampling.downsample - 1)) / sampling.downsample;
}

// What the outputs ask of a shadow-casting light's traversal.
void KeepWhatOutputsShow(const std::vector<ImageRequest>& images, Traversal& traversal) {
  for (const ImageRequest& image : images) {
    if (image.light_index != traversal.shadow_light) continue;
    traversal.keep_transmittance |= image.kind == ImageKind::kLightTransmittance;
    traversal.keep_light_buffer |= image.kind == ImageKind::kLightBuffer;
    traversal.keep_layers |= image.kind == ImageKind::kLightLayers;
  }
}

void DescribePasses(const Scene& scene, FramePlan& plan) {
  const ShadowTechnique& technique = TechniqueFor(scene.shadow.technique);
  for (const Traversal& traversal : plan.traversals) {
    if (traversal.shadow_light) {
      for (PlannedPass& pass : technique.DescribePasses(traversal)) {
        plan.passes.push_back(std::move(pass));
      }
    } else {
      plan.passes.push_back({traversal.axis ? "sort by depth" : "sort by distance from the eye",
                             "nothing casts shadows", 1});
      plan.passes.push_back({"project particles for the eye", "every traversal", 1});
      plan.passes.push_back({"composite", "the image", 1});
    }
  }
}

void DescribeSampling(const Sampling& sampling, FramePlan& plan) {
  if (sampling.supersample > 1) {
    plan.passes.push_back({"average samples", "supersample above 1", 1});
  }
  if (sampling.downsample > 1) {
    plan.passes.push_back({"enlarge samples", "downsample above 1", 1});
  }
}

}  // namespace

absl::StatusOr<FramePlan> PlanFrame(const FrameRequest& request, const ParticleView& particles) {
  const Scene& scene = request.scene;
  for (const ImageRequest& image : request.images) {
    if (image.kind == ImageKind::kError) {
      return absl::InvalidArgumentError(
          "outputs: error, allowed of the renderer: what is drawn; the error is made of a beauty");
    }
  }
  if (scene.shadow.technique == ShadowTechniqueKind::kReference) return PlanReferenceFrame(request);
  if (scene.lights.size() > kMaxLights) {
    return absl::InvalidArgumentError(absl::StrCat("lighting.lights: ", scene.lights.size(),
                                                   " lights, allowed: at most ", kMaxLights));
  }
  FramePlan plan;
  plan.window_size = {scene.camera.window.width, scene.camera.window.height};
  plan.composite_size = CompositeSize(scene.camera.window, scene.sampling);
  for (const ImageRequest& image : request.images) {
    plan.keep_depth |= image.kind == ImageKind::kDepth;
  }
  if (scene.shadow.technique == ShadowTechniqueKind::kLightSweep) {
    if (absl::Status status = PlanSweepFrame(request, particles, plan); !status.ok()) return status;
    DescribeSampling(scene.sampling, plan);
    return plan;
  }

  // One traversal for each light that casts shadows: each has an axis of its own.
  const ShadowTechnique& technique = TechniqueFor(scene.shadow.technique);
  std::vector<int> unshadowed;
  for (int light = 0; light < static_cast<int>(scene.lights.size()); ++light) {
    if (!scene.lights[static_cast<size_t>(light)].casts_shadows()) {
      unshadowed.push_back(light);
      continue;
    }
    absl::StatusOr<Traversal> traversal = technique.PlanLight(scene, particles, light);
    if (!traversal.ok()) return traversal.status();
    traversal->shadow_light = light;
    KeepWhatOutputsShow(request.images, *traversal);
    plan.traversals.push_back(*std::move(traversal));
  }
  // Without shadows: one walk in the order of distance from the eye, as the image model asks; of
  // parallel rays, each from an eye of its own, that is the depth along them.
  if (plan.traversals.empty()) {
    plan.traversals.emplace_back();
    if (std::holds_alternative<Orthographic>(scene.camera.projection)) {
      plan.traversals.front().axis = ViewDirection(scene.camera);
    }
  }
  plan.traversals.front().ambient_and_emission = true;
  plan.traversals.front().unshadowed_lights = std::move(unshadowed);

  DescribePasses(scene, plan);
  DescribeSampling(scene.sampling, plan);
  return plan;
}

}  // namespace halflight
