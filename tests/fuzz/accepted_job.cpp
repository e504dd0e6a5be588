#include "tests/fuzz/accepted_job.h"

#include <algorithm>
#include <string>

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "renderer/frame_plan.h"
#include "renderer/particle_view.h"
#include "renderer/projection.h"
#include "server/convert/geometry.h"
#include "server/error_detail.h"
#include "tests/fuzz/require.h"

namespace halflight::fuzz {
namespace {

template <typename T>
void RequireFinite(const T& values, const char* what) {
  for (int i = 0; i < values.length(); ++i) {
    if constexpr (requires { values[i].length(); }) {
      RequireFinite(values[i], what);
    } else {
      fuzz::RequireFinite(static_cast<double>(values[i]), what);
    }
  }
}

void RequireWithin(double value, double low, double high, const char* what) {
  if (!(value >= low && value <= high)) {
    Require(false, std::string(what) + " is within its limits: " + std::to_string(value));
  }
}

void RequireColor(const glm::vec3& color, const char* what) {
  RequireFinite(color, what);
  for (int i = 0; i < 3; ++i) {
    Require(color[i] >= 0.0F, std::string(what) + " is not negative");
  }
}

void CheckCamera(const Scene& scene, const ServerLimits& limits) {
  const Camera& camera = scene.camera;
  RequireFinite(camera.view_from_world, "view_from_world");
  Require(IsRigid(camera.view_from_world), "view_from_world is rigid");
  RequireWithin(camera.width, 1, limits.max_image_size, "width");
  RequireWithin(camera.height, 1, limits.max_image_size, "height");
  const PixelRect& window = camera.window;
  RequireWithin(window.x, 0, camera.width - window.width, "window.x");
  RequireWithin(window.y, 0, camera.height - window.height, "window.y");
  Require(window.width > 0 && window.height > 0, "the window is not empty");
  const glm::ivec2 samples = CompositeSize(window, scene.sampling);
  RequireWithin(samples.x, 1, limits.max_image_size, "samples along x");
  RequireWithin(samples.y, 1, limits.max_image_size, "samples along y");
  RequireFinite(NdcFromWorld(camera), "NdcFromWorld");
}

void CheckLights(const Scene& scene, const ServerLimits& limits) {
  RequireWithin(static_cast<double>(scene.lights.size()), 0, limits.max_lights, "lights");
  for (const Light& light : scene.lights) {
    RequireColor(light.color, "light.color");
    RequireColor(light.shadow_density, "light.shadow_density");
    if (const auto* const sun = std::get_if<DirectionalLight>(&light.kind)) {
      RequireWithin(glm::length(sun->direction), 1 - 1e-9, 1 + 1e-9, "length of a direction");
    } else {
      RequireFinite(std::get<PointLight>(light.kind).position, "light.position");
    }
  }
}

void CheckMaterial(const Scene& scene) {
  const Material& material = scene.material;
  if (scene.particles->radii.empty() && scene.particles->size() > 0) {
    RequireWithin(material.radius, kSmallestRadius * 0.999, kLargestLength * 1.001, "radius");
  }
  RequireWithin(material.opacity, 0, 1, "opacity");
  RequireColor(material.albedo, "albedo");
  RequireColor(material.emission, "emission");
  RequireColor(material.ambient, "ambient");
  RequireWithin(material.phase_g, -1, 1, "phase_g");
  fuzz::RequireFinite(material.scattering_spread, "scattering_spread");
  if (material.physical_scattering.has_value()) {
    RequireWithin(material.physical_scattering->mean_cosine, 0, 1, "mean_cosine");
    RequireWithin(material.physical_scattering->albedo, 0, 1, "albedo");
  }
}

void CheckShadow(const ShadowSettings& shadow, const ServerLimits& limits) {
  RequireWithin(shadow.slices, 1, limits.max_slices, "slices");
  if (shadow.light_buffer_size != 0) {
    RequireWithin(shadow.light_buffer_size, kMinLightBufferSize, limits.max_light_buffer_size,
                  "light_buffer_size");
  }
  RequireWithin(shadow.blur_texels, 0, 64, "blur_texels");
  RequireWithin(shadow.fit_degree, 0, kMaxFitDegree, "fit_degree");
}

void CheckOutputs(const FrameJob& job, const ServerLimits& limits) {
  RequireWithin(static_cast<double>(job.outputs.size()), 1, limits.max_outputs, "outputs");
  const auto& window = job.request.scene.camera.window;
  const double picture = 16.0 * window.width * window.height;
  RequireWithin(static_cast<double>(job.pixel_bytes), 1,
                2 * (static_cast<double>(limits.max_output_bytes) + picture), "pixel_bytes");
  for (const OutputJob& output : job.outputs) {
    const bool error = output.shown.kind == ImageKind::kError;
    Require(error ? output.image == job.request.images.size()
                  : output.image < job.request.images.size(),
            "an output has an image");
    Require(!error || (job.measure.has_value() && job.measure->map), "a map is measured");
  }
  for (const ImageRequest& image : job.request.images) {
    if (image.kind == ImageKind::kLightTransmittance || IsSeenFromLight(image.kind)) {
      Require(static_cast<size_t>(image.light_index) < job.request.scene.lights.size(),
              "an image shows a light of the scene");
    }
  }
  if (job.measure.has_value() && !job.measure->without_scattering) {
    Require(job.measure->beauty < job.request.images.size() &&
                job.request.images[job.measure->beauty].kind == ImageKind::kBeauty,
            "what is measured is a beauty");
  }
}

void CheckTarget(const TargetJob& target, const ServerLimits& limits) {
  Require(target.goal.max_error.has_value() || target.goal.max_time_ms.has_value(),
          "a target has a goal");
  RequireWithin(target.limits.max_slices, 1, limits.max_slices, "target's slices");
  RequireWithin(target.limits.max_light_buffer_size, 1, limits.max_light_buffer_size,
                "target's light buffer");
  Require(target.max_samples > 0 && target.knowledge != nullptr, "a target can be searched for");
}

void CheckBlock(const Projection& projection, const ParticleView& particles, const char* what) {
  const shader::ProjectionBlock block = projection.block(particles);
  RequireFinite(block.view_from_world, what);
  RequireFinite(block.near_translation, what);
  RequireFinite(block.far_translation, what);
  RequireFinite(block.pixel_from_plane, what);
  RequireFinite(block.plane_from_pixel, what);
  RequireFinite(block.target_size, what);
}

void CheckPlan(const FrameJob& job, const ServerLimits& limits) {
  const Scene& scene = job.request.scene;
  const ParticleView particles(scene);
  for (size_t i = 0; i < particles.size(); ++i) {
    RequireFinite(particles.positions()[i], "a position at the frame's time");
    fuzz::RequireFinite(particles.optical_depth(i), "an optical depth");
  }
  CheckBlock(EyeProjection(scene, CompositeSize(scene.camera.window, scene.sampling)), particles,
             "the eye's projection");
  const auto plan = PlanFrame(job.request, particles);
  if (!plan.ok()) {
    CheckRefused(plan.status());
    return;
  }
  RequireWithin(plan->light_buffer_size, 0, limits.max_light_buffer_size, "planned light buffers");
  for (const Traversal& traversal : plan->traversals) {
    RequireWithin(traversal.slices, 1, std::max<double>(1.0, static_cast<double>(particles.size())),
                  "planned slices");
    if (traversal.axis.has_value()) {
      RequireWithin(glm::length(*traversal.axis), 1 - 1e-6, 1 + 1e-6, "length of an axis");
    }
    if (traversal.shadow_light.has_value() && traversal.light_buffer_size > 0) {
      CheckBlock(LightProjection(scene.lights[static_cast<size_t>(*traversal.shadow_light)],
                                 particles, traversal.light_buffer_size, 0.0),
                 particles, "a light's projection");
    }
  }
}

}  // namespace

void CheckAccepted(const FrameJob& job, const ServerLimits& limits) {
  const Scene& scene = job.request.scene;
  Require(scene.particles != nullptr, "there are particles, be it none");
  fuzz::RequireFinite(scene.time_offset_s, "time_offset_s");
  Require(scene.sampling.supersample == 1 || scene.sampling.downsample == 1,
          "samples are more than pixels, or fewer");
  CheckCamera(scene, limits);
  CheckLights(scene, limits);
  CheckMaterial(scene);
  CheckShadow(scene.shadow, limits);
  CheckOutputs(job, limits);
  if (job.target.has_value()) {
    CheckTarget(*job.target, limits);
  }
  CheckPlan(job, limits);
}

void CheckRefused(const absl::Status& status) {
  const ErrorDetail detail = DetailOf(status);
  if (absl::IsNotFound(status)) {
    Require(detail.reason == v1::ERROR_REASON_PARTICLES_NOT_FOUND, "what is missing are particles");
    return;
  }
  Require(absl::IsInvalidArgument(status), "a refused request is invalid: " + status.ToString());
  Require(!detail.field.empty() && !detail.value.empty() && !detail.allowed.empty(),
          "a refusal names field, value and what is allowed: " + status.ToString());
}

}  // namespace halflight::fuzz
