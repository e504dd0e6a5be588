#include "renderer/techniques/light_sweep.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "renderer/frame_engine.h"
#include "renderer/frame_images.h"
#include "renderer/stage_clock.h"
#include "renderer/sweep/compositor.h"
#include "renderer/sweep/device/frame.h"
#include "renderer/sweep/light_fit.h"
#include "renderer/sweep/resample.h"
#include "renderer/sweep/shading.h"

namespace halflight {

namespace {

absl::Status Refuse(const std::string& field, const std::string& value, const char* allowed) {
  return absl::InvalidArgumentError(
      absl::StrCat(field, ": ", value, ", allowed under technique LIGHT_SWEEP: ", allowed));
}

absl::Status CheckRequest(const FrameRequest& request) {
  const Scene& scene = request.scene;
  if (scene.shadow.blur_mode == BlurMode::kTexelsPerSlice && scene.shadow.blur_texels > 0.0F) {
    return Refuse("shadow.blur_texels", absl::StrCat(scene.shadow.blur_texels),
                  "0, since it has no slices to blur between");
  }
  if (scene.material.scattering_spread > 0.0F) {
    return Refuse("material.scattering_spread", absl::StrCat(scene.material.scattering_spread),
                  "0, since it has no slices to blur between");
  }
  if (scene.material.scatters_physically()) {
    return Refuse("material.physical_scattering.albedo",
                  absl::StrCat(scene.material.physical_scattering->albedo),
                  "0, since it has no slices to blur between");
  }
  for (const ImageRequest& image : request.images) {
    if (image.kind == ImageKind::kLightLayers) {
      return Refuse("outputs", "light layers",
                    "beauty, coverage, depth, light transmittance, light buffer");
    }
  }
  return absl::OkStatus();
}

bool DrawsOnDevice(const DrawContext& context) {
  const SweepOn where = context.request.sweep_on;
  return where == SweepOn::kDevice || (where == SweepOn::kAuto && !context.device.software);
}

bool Shows(const FrameRequest& request, ImageKind kind) {
  for (const ImageRequest& image : request.images) {
    if (image.kind == kind) return true;
  }
  return false;
}

}  // namespace

absl::Status LightSweep::Plan(const FrameRequest& request, const ParticleView& particles,
                              FramePlan& plan) const {
  if (absl::Status status = CheckLightCount(request.scene); !status.ok()) return status;
  if (absl::Status status = CheckRequest(request); !status.ok()) return status;
  const std::vector<Light>& lights = request.scene.lights;
  for (size_t l = 0; l < lights.size(); ++l) {
    if (!lights[l].casts_shadows()) continue;
    if (LiesAmong(lights[l], particles)) {
      const glm::dvec3& at = std::get<PointLight>(lights[l].kind).position;
      return Refuse(absl::StrCat("lighting.lights[", l, "].point.position"),
                    absl::StrCat("(", at.x, ", ", at.y, ", ", at.z, ")"),
                    "outside the particles, for a light that casts shadows");
    }
    const std::string light = absl::StrCat("light ", l, " casts shadows");
    plan.passes.push_back({"sort along the light", light, 1});
    plan.passes.push_back({"sweep the light buffer through the particles", light, 1});
    plan.passes.push_back({"fit the light over every footprint", light, 1});
  }
  plan.passes.push_back({"sort by distance from the eye", "the image", 1});
  plan.passes.push_back({"composite tiles", "the image", 1});
  return absl::OkStatus();
}

namespace {

absl::StatusOr<DrawnFrame> DrawOnCpu(const DrawContext& context) {
  const FrameRequest& request = context.request;
  const ParticleView& particles = context.particles;
  const FramePlan& plan = context.plan;
  StageClock& clock = context.clock;
  const Scene& scene = request.scene;
  const size_t lights = scene.lights.size();
  DrawnImages drawn;
  drawn.transmittance.resize(lights);
  drawn.shadows.resize(lights);
  std::vector<LightReport> reports(lights);

  // Sweep every light that casts shadows through the particles.
  clock.BeginCpu("light");
  std::vector<std::optional<sweep::LightFit>> fits(lights);
  std::vector<const sweep::LightFit*> fit_of(lights, nullptr);
  for (size_t l = 0; l < lights; ++l) {
    if (!scene.lights[l].casts_shadows()) continue;
    absl::StatusOr<sweep::LightFit> fit =
        sweep::FitLight(scene.lights[l], particles, scene.material.profile,
                        scene.shadow.light_buffer_size, scene.shadow.fit_degree, context.stop);
    if (!fit.ok()) return fit.status();
    reports[l].casts_shadows = true;
    reports[l].light_texture_from_world = fit->projection.texture_from_world();
    reports[l].light_view_from_world = fit->projection.view_from_world;
    drawn.shadows[l].light_buffer = std::move(fit->optical_depth);
    fits[l] = *std::move(fit);
    fit_of[l] = &*fits[l];
  }

  // See the particles from the eye, in the light.
  clock.BeginCpu("project");
  const double samples = static_cast<double>(scene.sampling.supersample) /
                         static_cast<double>(scene.sampling.downsample);
  const Projection eye = EyeProjection(scene.camera, plan.composite_size, samples);
  const sweep::SpriteList list = sweep::ListSprites(particles, eye, sweep::NearDepth(scene));
  clock.BeginCpu("shade");
  const bool keep_transmittance = Shows(request, ImageKind::kLightTransmittance);
  const sweep::Shading shading =
      sweep::ShadeSprites(scene, particles, eye, list, fit_of, scene.shadow.fit_degree,
                          plan.keep_depth, keep_transmittance);
  clock.BeginCpu("composite");
  absl::StatusOr<sweep::Composite> composite = sweep::CompositeTiles(
      list, shading, eye, scene.material.profile, keep_transmittance, context.stop);
  if (!composite.ok()) return composite.status();

  const auto resample = [&](Image image) {
    return sweep::Resample(std::move(image), scene.sampling, plan.window_size);
  };
  drawn.beauty = resample(std::move(composite->beauty));
  if (plan.keep_depth) drawn.depth = resample(std::move(composite->depth));
  if (keep_transmittance) {
    for (size_t l = 0; l < lights; ++l) {
      if (fit_of[l] == nullptr) continue;
      const auto slot =
          static_cast<size_t>(sweep::TransmittanceSlot(shading.lights, static_cast<int>(l)));
      drawn.transmittance[l] = resample(composite->transmittance[slot]);
    }
  }
  clock.BeginCpu("images");
  return DrawnFrame{SelectImages(request, drawn), std::move(reports)};
}

}  // namespace

absl::StatusOr<DrawnFrame> LightSweep::Draw(const DrawContext& context) const {
  if (!DrawsOnDevice(context)) return DrawOnCpu(context);
  absl::StatusOr<DrawnFrame> frame = sweep::DrawOnDevice(context);
  // What the device cannot hold the CPU can, unless the device was asked for.
  const bool too_large = absl::IsResourceExhausted(frame.status());
  return too_large && context.request.sweep_on == SweepOn::kAuto ? DrawOnCpu(context) : frame;
}

}  // namespace halflight
