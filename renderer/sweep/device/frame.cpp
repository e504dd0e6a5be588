#include "renderer/sweep/device/frame.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "renderer/bands.h"
#include "renderer/frame_cache.h"
#include "renderer/frame_engine.h"
#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "renderer/passes/resolve.h"
#include "renderer/readback.h"
#include "renderer/stage_clock.h"
#include "renderer/sweep/device/compositor.h"
#include "renderer/sweep/device/light_fit.h"
#include "renderer/sweep/device/lists.h"
#include "renderer/sweep/device/runs.h"
#include "renderer/sweep/device/shading.h"

namespace halflight::sweep {

namespace {

// What a fit depends on: of the light, where it is and not how it shines.
struct DeviceFitKey {
  using Value = DeviceLightFit;
  ParticleViewKey particles;
  bool point = false;
  glm::dvec3 place{0.0};  // its position, or its direction
  Profile profile = Profile::kSoft;
  int light_buffer_size = 0;
  int degree = 0;

  bool operator==(const DeviceFitKey&) const = default;
};

DeviceFitKey FitKeyOf(const Scene& scene, const Light& light, const FramePlan& plan) {
  const auto* const point = std::get_if<PointLight>(&light.kind);
  return {.particles = ParticleViewKeyOf(scene),
          .point = point != nullptr,
          .place =
              point != nullptr ? point->position : std::get<DirectionalLight>(light.kind).direction,
          .profile = scene.material.profile,
          .light_buffer_size = plan.light_buffer_size,
          .degree = scene.shadow.fit_degree};
}

struct DeviceSpritesKey {
  using Value = DeviceSprites;
  ParticleViewKey particles;
  Projection eye;
  double near_depth = 0.0;

  bool operator==(const DeviceSpritesKey&) const = default;
};

// The eye's order cut into runs, with the tile lists of the first where it is the only one. Those
// of more take much room, and little time against what else such a frame needs.
struct EyeRuns {
  std::vector<ListedRun> runs;
  DeviceTiles tiles;

  [[nodiscard]] size_t bytes() const {
    return runs.capacity() * sizeof(ListedRun) + (runs.size() == 1 ? tiles.bytes() : 0);
  }
};

struct EyeRunsKey {
  using Value = EyeRuns;
  DeviceSpritesKey sprites;
  int tile_size = 0;
  size_t most_places = 0;

  bool operator==(const EyeRunsKey&) const = default;
};

// Tells which passes of the plan were not run: those that `kept` holds of.
template <typename Kept>
void MarkKept(const FramePlan& plan, const Kept& kept, DrawnFrame& frame) {
  std::copy_if(plan.passes.begin(), plan.passes.end(), std::back_inserter(frame.reused), kept);
}

// The light's fit, from an earlier frame or made now.
absl::StatusOr<std::shared_ptr<const DeviceLightFit>> FitOf(const DrawContext& context,
                                                            const ParticleBuffers& buffers,
                                                            size_t light, DrawnFrame& frame) {
  const Scene& scene = context.request.scene;
  bool made = false;
  auto fit = context.cache.FindOrMake(
      scene.particles, FitKeyOf(scene, scene.lights[light], context.plan), [&] {
        made = true;
        return FitLightOnDevice(context.gpu, scene.lights[light], context.particles, buffers,
                                scene.material.profile, context.plan.light_buffer_size,
                                scene.shadow.fit_degree, context.stop,
                                LightSweepSettingsFor(context.device));
      });
  if (!made) {
    const std::string reason = absl::StrCat("light ", light, " casts shadows");
    MarkKept(
        context.plan,
        [&](const PlannedPass& pass) { return absl::StartsWith(pass.reason, reason); }, frame);
  }
  return fit;
}

// What the eye sees, from an earlier frame or listed now.
absl::StatusOr<std::shared_ptr<const DeviceSprites>> SpritesOf(const DrawContext& context,
                                                               const ParticleBuffers& buffers,
                                                               const DeviceSpritesKey& key,
                                                               DrawnFrame& frame) {
  bool made = false;
  auto sprites = context.cache.FindOrMake(
      context.request.scene.particles, key, [&]() -> absl::StatusOr<DeviceSprites> {
        made = true;
        absl::StatusOr<DeviceSprites> list =
            ListDeviceSprites(context.gpu, buffers, context.particles, key.eye, key.near_depth);
        // What did not fit must not be found again.
        if (absl::Status status = gl::CheckErrors("eye's sprites"); !status.ok()) return status;
        return list;
      });
  if (!made) {
    MarkKept(
        context.plan,
        [](const PlannedPass& pass) { return pass.name == "sort by distance from the eye"; },
        frame);
  }
  return sprites;
}

// Its runs, and their tiles.
absl::StatusOr<std::shared_ptr<const EyeRuns>> RunsOf(const DrawContext& context,
                                                      const DeviceSprites& sprites,
                                                      const EyeRunsKey& key) {
  return context.cache.FindOrMake(
      context.request.scene.particles, key, [&]() -> absl::StatusOr<EyeRuns> {
        EyeRuns made;
        auto runs = CutIntoListedRuns(context.gpu, sprites, key.tile_size, key.most_places);
        if (!runs.ok()) return runs.status();
        made.runs = *std::move(runs);
        if (made.runs.size() == 1) {
          auto tiles = ListDeviceTiles(context.gpu, sprites.rects, made.runs[0].places,
                                       key.sprites.eye.size, key.tile_size, made.runs[0].entries);
          if (!tiles.ok()) return tiles.status();
          made.tiles = *std::move(tiles);
        }
        if (absl::Status status = gl::CheckErrors("eye's tiles"); !status.ok()) return status;
        return made;
      });
}

// Parts of the image that textures hold; their samples begin and end with tiles, or with the image.
std::vector<Band> CutIntoTileBands(const DrawContext& context, int tile_size) {
  const glm::ivec2& window = context.plan.window_size;
  const glm::ivec2& samples = context.plan.composite_size;
  const int most = context.device.max_texture_size;
  const bool whole = std::max({window.x, window.y, samples.x, samples.y}) <= most;
  std::vector<Band> bands = CutIntoBands(window, samples, context.request.scene.sampling,
                                         whole ? most : most - 2 * tile_size);
  const auto extend = [tile_size](int& first, int& count, int all) {
    const int begin = first / tile_size * tile_size;
    const int end = (first + count + tile_size - 1) / tile_size * tile_size;
    first = begin;
    count = std::min(end, all) - begin;
  };
  for (Band& band : bands) {
    extend(band.samples.x, band.samples.width, samples.x);
    extend(band.samples.y, band.samples.height, samples.y);
  }
  return bands;
}

// Slots of the lights whose transmittance an output shows.
std::vector<int> ShownSlots(const FrameRequest& request, const std::vector<TileLight>& lights) {
  std::vector<int> slots;
  for (const ImageRequest& image : request.images) {
    if (image.kind != ImageKind::kLightTransmittance) continue;
    if (!request.scene.lights[static_cast<size_t>(image.light_index)].casts_shadows()) continue;
    slots.push_back(TransmittanceSlot(lights, image.light_index));
  }
  return slots;
}

// What the eye pass begins with.
struct SeenScene {
  const ParticleBuffers& buffers;
  const TargetProjection& eye;
  const DeviceSprites& sprites;
  const std::vector<const DeviceLightFit*>& fits;
  const ShadedLayout& layout;
};

// Shades and composites run after run, each over all parts of the image.
absl::Status CompositeRuns(const DrawContext& context, const SeenScene& seen, const EyeRuns& eye,
                           const TileWalk& walk, const std::vector<TileTargets>& targets) {
  const Scene& scene = context.request.scene;
  for (const ListedRun& run : eye.runs) {
    DeviceTiles listed;
    if (eye.runs.size() > 1) {
      context.clock.BeginGpu("project");
      absl::StatusOr<DeviceTiles> tiles =
          ListDeviceTiles(context.gpu, seen.sprites.rects, run.places, seen.eye.projection.size,
                          walk.tile_size, run.entries);
      if (!tiles.ok()) return tiles.status();
      listed = *std::move(tiles);
    }
    context.clock.BeginGpu("shade");
    const absl::StatusOr<ShadedPlaces> shaded =
        ShadePlaces(context.gpu, scene, seen.buffers, seen.eye, seen.sprites, seen.fits,
                    seen.layout, run.places);
    if (!shaded.ok()) return shaded.status();
    context.clock.BeginGpu("composite");
    for (const TileTargets& part : targets) {
      absl::Status status =
          CompositePlaces(context.gpu, scene, seen.eye, seen.layout, *shaded,
                          eye.runs.size() > 1 ? listed : eye.tiles, walk, part, context.stop);
      if (!status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

// Has a part of the image read back, resolved to its pixels where sampling asks for it.
absl::Status ReadBand(const DrawContext& context, const gl::Texture& texture, const Band& band,
                      Readback& readback, Image& image) {
  const Sampling& sampling = context.request.scene.sampling;
  const PixelRect& pixels = band.pixels;
  const ImagePlace place{.image = image, .at = {pixels.x, pixels.y}};
  if (sampling.supersample == 1 && sampling.downsample == 1) {
    readback.Copy(
        texture,
        {pixels.x - band.samples.x, pixels.y - band.samples.y, pixels.width, pixels.height}, place);
    return absl::OkStatus();
  }
  const absl::StatusOr<gl::Texture> resolved =
      ResolveSamples(context.gpu, texture, sampling, band, context.plan.composite_size);
  if (!resolved.ok()) return resolved.status();
  readback.Copy(*resolved, place);
  return absl::OkStatus();
}

absl::Status ReadTargets(const DrawContext& context, const std::vector<TileLight>& lights,
                         const std::vector<Band>& bands, const std::vector<TileTargets>& targets,
                         ArrivingImages& arriving) {
  const glm::ivec2& window = context.plan.window_size;
  absl::Status status;
  const auto read = [&](size_t band, const gl::Texture& texture, Image& image) {
    if (!texture) return;
    if (band == 0) image = {window.x, window.y, 1, {"R", "G", "B", "A"}, {}};
    status.Update(ReadBand(context, texture, bands[band], arriving.readback, image));
  };
  arriving.readback.BeginStage(context.clock);
  for (size_t b = 0; b < bands.size(); ++b) {
    read(b, targets[b].beauty, arriving.drawn.beauty);
    read(b, targets[b].depth, arriving.drawn.depth);
    for (size_t slot = 0; slot < lights.size(); ++slot) {
      read(b, targets[b].transmittance[slot],
           arriving.drawn.transmittance[static_cast<size_t>(lights[slot].light)]);
    }
  }
  return status;
}

}  // namespace

absl::StatusOr<DrawnFrame> DrawOnDevice(const DrawContext& context,
                                        const DeviceFrameSettings& settings) {
  const FrameRequest& request = context.request;
  const Scene& scene = request.scene;
  const size_t lights = scene.lights.size();
  DrawnFrame frame;
  frame.arriving = std::make_unique<ArrivingImages>(context.staging);
  DrawnImages& drawn = frame.arriving->drawn;
  drawn.transmittance.resize(lights);
  drawn.shadows.resize(lights);
  frame.reports.resize(lights);

  // Bring the particles to the device.
  context.clock.BeginGpu("upload");
  const auto buffers = ParticlesOnDevice(context.cache, scene, context.particles);
  if (!buffers.ok()) return buffers.status();

  // Sweep every light that casts shadows through them.
  context.clock.BeginGpu("light");
  std::vector<std::shared_ptr<const DeviceLightFit>> fits(lights);
  std::vector<const DeviceLightFit*> fit_of(lights, nullptr);
  for (size_t l = 0; l < lights; ++l) {
    if (!scene.lights[l].casts_shadows()) continue;
    auto fit = FitOf(context, **buffers, l, frame);
    if (!fit.ok()) return fit.status();
    fits[l] = *std::move(fit);
    fit_of[l] = fits[l].get();
    frame.reports[l] = ReportOf(fits[l]->projection);
    if (ShowsOfLight(request, ImageKind::kLightBuffer, l)) {
      ReadOpticalDepth(*fits[l], frame.arriving->readback, drawn.shadows[l].light_buffer);
    }
  }

  // See the particles from the eye, in the light.
  context.clock.BeginGpu("project");
  const TargetProjection eye =
      UploadProjection(EyeProjection(scene, context.plan.composite_size), context.particles);
  const DeviceSpritesKey key{ParticleViewKeyOf(scene), eye.projection, NearDepth(scene)};
  const auto sprites = SpritesOf(context, **buffers, key, frame);
  if (!sprites.ok()) return sprites.status();
  const std::vector<int> shown =
      ShownSlots(request, ListTileLights(scene, /*keep_transmittance=*/true));
  const ShadedLayout layout = LayOutShading(scene, **sprites, scene.shadow.fit_degree,
                                            context.plan.keep_depth, !shown.empty());
  const TileWalk walk = TileWalkFor(context.device);
  const size_t most_places =
      MostShadedPlaces(layout, std::min(settings.most_run_bytes, gl::StorageBlockLimit()));
  const auto runs = RunsOf(context, **sprites, {key, walk.tile_size, most_places});
  if (!runs.ok()) return runs.status();
  const std::vector<Band> bands = CutIntoTileBands(context, walk.tile_size);
  std::vector<TileTargets> targets;
  for (const Band& band : bands) {
    targets.push_back(MakeTileTargets({band.samples.width, band.samples.height}, layout, shown));
    targets.back().first_tile = glm::ivec2(band.samples.x, band.samples.y) / walk.tile_size;
  }
  absl::Status status =
      CompositeRuns(context, {**buffers, eye, **sprites, fit_of, layout}, **runs, walk, targets);
  if (!status.ok()) return status;

  status = ReadTargets(context, layout.lights, bands, targets, *frame.arriving);
  status.Update(gl::CheckErrors("frame"));
  if (!status.ok()) return status;
  return frame;
}

}  // namespace halflight::sweep
