#include "renderer/techniques/light_sweep.h"

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "renderer/frame_cache.h"
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

constexpr char kName[] = "LIGHT_SWEEP";

std::vector<PlannedPass> LightPasses(size_t light) {
  const std::string reason = absl::StrCat("light ", light, " casts shadows");
  return {{"sort along the light", reason, 1},
          {"sweep the light buffer through the particles", reason, 1},
          {"fit the light over every footprint", reason, 1}};
}

const PlannedPass& EyeSort() {
  static const PlannedPass pass{"sort by distance from the eye", "the image", 1};
  return pass;
}

// What a fit depends on: of the light, where it is and not how it shines.
struct LightFitKey {
  using Value = sweep::LightFit;
  ParticleViewKey particles;
  bool point = false;
  glm::dvec3 place{0.0};  // its position, or its direction
  Profile profile = Profile::kSoft;
  int light_buffer_size = 0;
  int degree = 0;

  bool operator==(const LightFitKey&) const = default;
};

LightFitKey LightFitKeyOf(const Scene& scene, const Light& light) {
  LightFitKey key{.particles = ParticleViewKeyOf(scene),
                  .profile = scene.material.profile,
                  .light_buffer_size = scene.shadow.light_buffer_size,
                  .degree = scene.shadow.fit_degree};
  if (const auto* const point = std::get_if<PointLight>(&light.kind)) {
    key.point = true;
    key.place = point->position;
  } else {
    key.place = std::get<DirectionalLight>(light.kind).direction;
  }
  return key;
}

struct SpriteListKey {
  using Value = sweep::SpriteList;
  ParticleViewKey particles;
  Projection eye;
  double near_depth = 0.0;

  bool operator==(const SpriteListKey&) const = default;
};

// Of a list that is one run. Those of more take much room, and little time against what else such a
// frame needs.
struct TileListsKey {
  using Value = sweep::TileLists;
  SpriteListKey list;

  bool operator==(const TileListsKey&) const = default;
};

// The light's fit, from an earlier frame or made now.
absl::StatusOr<std::shared_ptr<const sweep::LightFit>> FitOf(const DrawContext& context,
                                                             size_t light, DrawnFrame& frame) {
  const Scene& scene = context.request.scene;
  bool made = false;
  auto fit =
      context.cache.FindOrMake(scene.particles, LightFitKeyOf(scene, scene.lights[light]), [&] {
        made = true;
        return sweep::FitLight(scene.lights[light], context.particles, scene.material.profile,
                               scene.shadow.light_buffer_size, scene.shadow.fit_degree,
                               context.stop);
      });
  if (!made) {
    for (PlannedPass& pass : LightPasses(light)) frame.reused.push_back(std::move(pass));
  }
  return fit;
}

// What the eye sees, from an earlier frame or listed now.
absl::StatusOr<std::shared_ptr<const sweep::SpriteList>> SpritesOf(const DrawContext& context,
                                                                   const SpriteListKey& key,
                                                                   DrawnFrame& frame) {
  bool made = false;
  auto list = context.cache.FindOrMake(
      context.request.scene.particles, key, [&]() -> absl::StatusOr<sweep::SpriteList> {
        made = true;
        return sweep::ListSprites(context.particles, key.eye, key.near_depth);
      });
  if (!made) frame.reused.push_back(EyeSort());
  return list;
}

// The tiles of one of the list's runs.
absl::StatusOr<std::shared_ptr<const sweep::TileLists>> TilesOf(const DrawContext& context,
                                                                const SpriteListKey& key,
                                                                const sweep::SpriteList& list,
                                                                const sweep::TileRun& run) {
  FrameCache nothing_kept(0);
  FrameCache& cache = run.size() == list.rects.size() ? context.cache : nothing_kept;
  return cache.FindOrMake(context.request.scene.particles, TileListsKey{key},
                          [&]() -> absl::StatusOr<sweep::TileLists> {
                            const std::span<const sweep::Rect> rects(list.rects);
                            return sweep::ListTiles(rects.subspan(run.begin, run.size()),
                                                    key.eye.size, sweep::kImageTile);
                          });
}

}  // namespace

absl::Status LightSweep::Check(const FrameRequest& request) const {
  const Scene& scene = request.scene;
  if (absl::Status status = CheckLightCount(scene); !status.ok()) return status;
  if (Shows(request, ImageKind::kLightLayers)) {
    return Refuse("outputs", "light layers", kName,
                  "beauty, coverage, depth, light transmittance, light buffer");
  }
  const glm::ivec2 size = CompositeSize(scene.camera.window, scene.sampling);
  if (std::max(size.x, size.y) > sweep::kMaxTargetSide) {
    return Refuse("camera size times sampling", absl::StrCat(std::max(size.x, size.y), " pixels"),
                  kName, absl::StrCat("at most ", sweep::kMaxTargetSide));
  }
  return CheckNoScattering(scene, kName, "it has no slices to blur between");
}

absl::Status LightSweep::Plan(const FrameRequest& request, const ParticleView& particles,
                              FramePlan& plan) const {
  const Scene& scene = request.scene;
  if (absl::Status status = CheckLightsOutside(scene, particles, kName); !status.ok()) {
    return status;
  }
  for (size_t l = 0; l < scene.lights.size(); ++l) {
    if (!scene.lights[l].casts_shadows()) continue;
    for (PlannedPass& pass : LightPasses(l)) plan.passes.push_back(std::move(pass));
  }
  plan.passes.push_back(EyeSort());
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
  DrawnFrame frame;
  frame.reports.resize(lights);
  DrawnImages drawn;
  drawn.transmittance.resize(lights);
  drawn.shadows.resize(lights);

  // Sweep every light that casts shadows through the particles.
  clock.BeginCpu("light");
  std::vector<std::shared_ptr<const sweep::LightFit>> fits(lights);
  std::vector<const sweep::LightFit*> fit_of(lights, nullptr);
  for (size_t l = 0; l < lights; ++l) {
    if (!scene.lights[l].casts_shadows()) continue;
    auto fit = FitOf(context, l, frame);
    if (!fit.ok()) return fit.status();
    fits[l] = *std::move(fit);
    fit_of[l] = fits[l].get();
    frame.reports[l] = ReportOf(fits[l]->projection);
  }

  // See the particles from the eye.
  clock.BeginCpu("project");
  const Projection eye = EyeProjection(scene, plan.composite_size);
  const SpriteListKey list_key{ParticleViewKeyOf(scene), eye, sweep::NearDepth(scene)};
  const auto list = SpritesOf(context, list_key, frame);
  if (!list.ok()) return list.status();

  // Run by run, shade them and draw them behind those that are nearer.
  const bool keep_transmittance = Shows(request, ImageKind::kLightTransmittance);
  const std::vector<sweep::TileLight> tile_lights =
      sweep::ListTileLights(scene, keep_transmittance);
  sweep::Composite composite = sweep::MakeComposite(plan.composite_size, plan.keep_depth,
                                                    keep_transmittance ? tile_lights.size() : 0);
  for (const sweep::TileRun& run : sweep::CutIntoRuns((*list)->rects, sweep::kImageTile, {})) {
    clock.BeginCpu("project");
    const auto tiles = TilesOf(context, list_key, **list, run);
    if (!tiles.ok()) return tiles.status();
    clock.BeginCpu("shade");
    const sweep::Shading shading =
        sweep::ShadeSprites(scene, particles, eye, **list, run, tile_lights, fit_of,
                            scene.shadow.fit_degree, plan.keep_depth);
    clock.BeginCpu("composite");
    if (!sweep::CompositeRun(**list, **tiles, shading, eye, scene.material.profile, context.stop,
                             composite)) {
      return absl::CancelledError("frame cancelled");
    }
  }

  const auto resample = [&](Image image) {
    return sweep::Resample(std::move(image), scene.sampling, plan.window_size);
  };
  drawn.beauty = resample(std::move(composite.beauty));
  if (plan.keep_depth) drawn.depth = resample(std::move(composite.depth));
  for (size_t l = 0; l < lights; ++l) {
    if (fit_of[l] == nullptr) continue;
    if (keep_transmittance) {
      drawn.transmittance[l] = resample(composite.transmittance[static_cast<size_t>(
          sweep::TransmittanceSlot(tile_lights, static_cast<int>(l)))]);
    }
    if (ShowsOfLight(request, ImageKind::kLightBuffer, l)) {
      drawn.shadows[l].light_buffer = fits[l]->optical_depth;
    }
  }
  clock.BeginCpu("images");
  frame.images = SelectImages(request, std::move(drawn));
  return frame;
}

}  // namespace

bool LightSweep::DrawsOnDevice(const FrameRequest& request, const DeviceInfo& device) const {
  const SweepOn where = request.sweep_on;
  return where == SweepOn::kDevice || (where == SweepOn::kAuto && !device.software);
}

absl::StatusOr<DrawnFrame> LightSweep::Draw(const DrawContext& context) const {
  if (!DrawsOnDevice(context.request, context.device)) return DrawOnCpu(context);
  absl::StatusOr<DrawnFrame> frame = sweep::DrawOnDevice(context);
  // What the device cannot hold the CPU can, unless the device was asked for.
  const bool too_large = absl::IsResourceExhausted(frame.status());
  if (too_large && context.request.sweep_on == SweepOn::kAuto) return DrawOnCpu(context);
  return frame;
}

}  // namespace halflight
