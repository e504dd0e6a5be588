#include "renderer/sweep/cpu_frame.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "renderer/frame_cache.h"
#include "renderer/frame_images.h"
#include "renderer/stage_clock.h"
#include "renderer/sweep/compositor.h"
#include "renderer/sweep/light_fit.h"
#include "renderer/sweep/resample.h"
#include "renderer/sweep/shading.h"

namespace halflight::sweep {

namespace {

std::vector<PlannedPass> LightPasses(const Traversal& traversal, bool layered) {
  const std::string reason = absl::StrCat("light ", *traversal.shadow_light, " casts shadows");
  const int slabs = traversal.slices;
  const int size = traversal.light_buffer_size;
  const std::string texels = absl::StrCat(", on ", size, " x ", size, " texels");
  std::vector<PlannedPass> passes = {{"sort along the light", reason, 1}};
  if (traversal.blur) passes.push_back({"blur light buffer", "the light scatters", slabs - 1});
  passes.push_back(
      {layered ? "deposit slice into light buffer" : "sweep the light buffer through the particles",
       reason + texels, slabs});
  if (traversal.keep_layers) passes.push_back({"keep layer", "light layers wanted", slabs});
  passes.push_back({"fit the light over every footprint", reason, 1});
  return passes;
}

const PlannedPass& EyeSort() {
  static const PlannedPass pass{"sort by distance from the eye", "the image", 1};
  return pass;
}

// What a fit depends on: of the light, where it is and not how it shines.
struct LightFitKey {
  using Value = LightFit;
  ParticleViewKey particles;
  bool point = false;
  glm::dvec3 place{0.0};  // its position, or its direction
  Profile profile = Profile::kSoft;
  int light_buffer_size = 0;
  int degree = 0;
  bool layered = false;
  int slices = 1;
  SliceSpacing spacing = SliceSpacing::kEqualCount;
  bool keep_layers = false;
  // How its light scatters, and with what density; of a light that does not, nothing.
  struct Scattering {
    glm::vec3 density{0.0F};
    float spread = 0.0F;
    std::optional<PhysicalScattering> physical;
    BlurMode blur_mode = BlurMode::kDistance;
    float blur_texels = 0.0F;

    bool operator==(const Scattering&) const = default;
  };
  std::optional<Scattering> scattering = std::nullopt;

  bool operator==(const LightFitKey&) const = default;
};

LightFitKey LightFitKeyOf(const Scene& scene, const Traversal& traversal) {
  const Light& light = scene.lights[static_cast<size_t>(*traversal.shadow_light)];
  LightFitKey key{.particles = ParticleViewKeyOf(scene),
                  .profile = scene.material.profile,
                  .light_buffer_size = traversal.light_buffer_size,
                  .degree = scene.shadow.fit_degree,
                  .layered = IsLayered(scene),
                  .slices = traversal.slices,
                  .spacing = traversal.spacing,
                  .keep_layers = traversal.keep_layers};
  if (const auto* const point = std::get_if<PointLight>(&light.kind)) {
    key.point = true;
    key.place = point->position;
  } else {
    key.place = std::get<DirectionalLight>(light.kind).direction;
  }
  if (traversal.blur) {
    key.scattering = {.density = light.shadow_density,
                      .spread = scene.material.scattering_spread,
                      .physical = scene.material.physical_scattering,
                      .blur_mode = scene.shadow.blur_mode,
                      .blur_texels = scene.shadow.blur_texels};
  }
  return key;
}

struct SpriteListKey {
  using Value = SpriteList;
  ParticleViewKey particles;
  Projection eye;
  double near_depth = 0.0;

  bool operator==(const SpriteListKey&) const = default;
};

// Of a list that is one run. Those of more take much room, and little time against what else such a
// frame needs.
struct TileListsKey {
  using Value = TileLists;
  SpriteListKey list;

  bool operator==(const TileListsKey&) const = default;
};

// The light's fit, from an earlier frame or made now.
absl::StatusOr<std::shared_ptr<const LightFit>> FitOf(const DrawContext& context,
                                                      const Traversal& traversal,
                                                      DrawnFrame& frame) {
  const Scene& scene = context.request.scene;
  bool made = false;
  auto fit = context.cache.FindOrMake(scene.particles, LightFitKeyOf(scene, traversal), [&] {
    made = true;
    return FitLight(scene, context.particles, traversal, context.stop);
  });
  if (!made) {
    for (PlannedPass& pass : LightPasses(traversal, IsLayered(scene))) {
      frame.reused.push_back(std::move(pass));
    }
  }
  return fit;
}

// What a tool needs to place the light's buffer, and its layers.
LightReport ReportOf(const LightFit& fit, const Traversal& traversal, bool layered) {
  LightReport report = halflight::ReportOf(fit.projection);
  if (traversal.blur || traversal.keep_layers || layered) {
    report.slice_axis = *traversal.axis;
    report.slices = traversal.slices;
  }
  return report;
}

// What the eye sees, from an earlier frame or listed now.
absl::StatusOr<std::shared_ptr<const SpriteList>> SpritesOf(const DrawContext& context,
                                                            const SpriteListKey& key,
                                                            DrawnFrame& frame) {
  bool made = false;
  auto list = context.cache.FindOrMake(
      context.request.scene.particles, key, [&]() -> absl::StatusOr<SpriteList> {
        made = true;
        return ListSprites(context.particles, key.eye, key.near_depth);
      });
  if (!made) frame.reused.push_back(EyeSort());
  return list;
}

// The tiles of one of the list's runs.
absl::StatusOr<std::shared_ptr<const TileLists>> TilesOf(const DrawContext& context,
                                                         const SpriteListKey& key,
                                                         const SpriteList& list,
                                                         const TileRun& run) {
  FrameCache nothing_kept(0);
  FrameCache& cache = run.size() == list.rects.size() ? context.cache : nothing_kept;
  return cache.FindOrMake(
      context.request.scene.particles, TileListsKey{key}, [&]() -> absl::StatusOr<TileLists> {
        const std::span<const Rect> rects(list.rects);
        return ListTiles(rects.subspan(run.begin, run.size()), key.eye.size, kImageTile);
      });
}

}  // namespace

absl::Status CheckSizes(const FrameRequest& request, const char* technique) {
  const Scene& scene = request.scene;
  if (absl::Status status = CheckLightCount(scene); !status.ok()) return status;
  const glm::ivec2 size = CompositeSize(scene.camera.window, scene.sampling);
  if (std::max(size.x, size.y) <= kMaxTargetSide) return absl::OkStatus();
  return Refuse("camera size times sampling", absl::StrCat(std::max(size.x, size.y), " pixels"),
                technique, absl::StrCat("at most ", kMaxTargetSide));
}

absl::Status PlanFrame(const FrameRequest& request, const ParticleView& particles,
                       const char* technique, FramePlan& plan) {
  const Scene& scene = request.scene;
  if (absl::Status status = CheckLightsOutside(scene, particles, technique); !status.ok()) {
    return status;
  }
  for (size_t l = 0; l < scene.lights.size(); ++l) {
    if (!scene.lights[l].casts_shadows()) continue;
    plan.traversals.push_back(PlanLight(scene, particles, static_cast<int>(l),
                                        ShowsOfLight(request, ImageKind::kLightLayers, l)));
    for (PlannedPass& pass : LightPasses(plan.traversals.back(), IsLayered(scene))) {
      plan.passes.push_back(std::move(pass));
    }
  }
  plan.passes.push_back(EyeSort());
  plan.passes.push_back({"composite tiles", "the image", 1});
  return absl::OkStatus();
}

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
  std::vector<std::shared_ptr<const LightFit>> fits(lights);
  std::vector<const LightFit*> fit_of(lights, nullptr);
  for (const Traversal& traversal : plan.traversals) {
    auto fit = FitOf(context, traversal, frame);
    if (!fit.ok()) return fit.status();
    const auto l = static_cast<size_t>(*traversal.shadow_light);
    fits[l] = *std::move(fit);
    fit_of[l] = fits[l].get();
    frame.reports[l] = ReportOf(*fits[l], traversal, IsLayered(scene));
  }

  // See the particles from the eye.
  clock.BeginCpu("project");
  const Projection eye = EyeProjection(scene, plan.composite_size);
  const SpriteListKey list_key{ParticleViewKeyOf(scene), eye, NearDepth(scene)};
  const auto list = SpritesOf(context, list_key, frame);
  if (!list.ok()) return list.status();

  clock.BeginCpu("composite");
  const bool keep_transmittance = Shows(request, ImageKind::kLightTransmittance);
  const std::vector<TileLight> tile_lights = ListTileLights(scene, keep_transmittance);
  Composite composite = MakeComposite(plan.composite_size, plan.keep_depth,
                                      keep_transmittance ? tile_lights.size() : 0, context.stop);
  if (context.stop.stop_requested()) return absl::CancelledError("frame cancelled");

  // Run by run, shade them and draw them behind those that are nearer.
  for (const TileRun& run : CutIntoRuns((*list)->rects, kImageTile, {})) {
    clock.BeginCpu("project");
    const auto tiles = TilesOf(context, list_key, **list, run);
    if (!tiles.ok()) return tiles.status();
    clock.BeginCpu("shade");
    const Shading shading = ShadeSprites(scene, particles, eye, **list, run, tile_lights, fit_of,
                                         scene.shadow.fit_degree, plan.keep_depth);
    clock.BeginCpu("composite");
    if (!CompositeRun(**list, **tiles, shading, eye, scene.material.profile, context.stop,
                      composite)) {
      return absl::CancelledError("frame cancelled");
    }
  }

  const auto resample = [&](Image image) {
    return Resample(std::move(image), scene.sampling, plan.window_size);
  };
  drawn.beauty = resample(std::move(composite.beauty));
  if (plan.keep_depth) drawn.depth = resample(std::move(composite.depth));
  for (size_t l = 0; l < lights; ++l) {
    if (fit_of[l] == nullptr) continue;
    if (keep_transmittance) {
      drawn.transmittance[l] = resample(composite.transmittance[static_cast<size_t>(
          TransmittanceSlot(tile_lights, static_cast<int>(l)))]);
    }
    if (ShowsOfLight(request, ImageKind::kLightBuffer, l)) {
      drawn.shadows[l].light_buffer = fits[l]->optical_depth;
    }
    drawn.shadows[l].light_layers = fits[l]->layers;
  }
  clock.BeginCpu("images");
  frame.images = SelectImages(request, std::move(drawn));
  return frame;
}

}  // namespace halflight::sweep
