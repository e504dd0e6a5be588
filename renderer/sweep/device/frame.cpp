#include "renderer/sweep/device/frame.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "renderer/frame_engine.h"
#include "renderer/frame_images.h"
#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "renderer/passes/resolve.h"
#include "renderer/stage_clock.h"
#include "renderer/sweep/device/compositor.h"
#include "renderer/sweep/device/light_fit.h"
#include "renderer/sweep/device/lists.h"
#include "renderer/sweep/device/shading.h"

namespace halflight::sweep {

namespace {

absl::Status CheckTargetSize(const DrawContext& context) {
  const glm::ivec2& size = context.plan.composite_size;
  const int side = std::max(size.x, size.y);
  if (side <= context.device.max_texture_size) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("camera size times sampling: ", side, " pixels, allowed on ",
                   context.device.gl_renderer, ": at most ", context.device.max_texture_size));
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

// Shades and composites run after run, as long as buffers hold.
absl::Status CompositeRuns(const DrawContext& context, const SeenScene& seen, size_t most_bytes,
                           const TileTargets& targets) {
  const Scene& scene = context.request.scene;
  const TileWalk walk = TileWalkFor(context.device);
  size_t most = MostShadedPlaces(seen.layout, std::min(most_bytes, gl::StorageBlockLimit()));
  for (size_t first = 0; first < seen.sprites.count;) {
    const PlaceRun run{first, std::min(first + most, seen.sprites.count)};
    context.clock.BeginGpu("project");
    absl::StatusOr<DeviceTiles> tiles =
        ListDeviceTiles(context.gpu, seen.sprites, run, seen.eye.projection.size, walk.tile_size);
    if (absl::IsResourceExhausted(tiles.status()) && most > kShadedAlignment) {
      most = std::max<size_t>(most / 2 / kShadedAlignment, 1) * kShadedAlignment;
      continue;
    }
    if (!tiles.ok()) return tiles.status();
    context.clock.BeginGpu("shade");
    absl::StatusOr<ShadedPlaces> shaded = ShadePlaces(context.gpu, scene, seen.buffers, seen.eye,
                                                      seen.sprites, seen.fits, seen.layout, run);
    if (!shaded.ok()) return shaded.status();
    context.clock.BeginGpu("composite");
    absl::Status status = CompositePlaces(context.gpu, scene, seen.eye, seen.layout, *shaded,
                                          *tiles, walk, targets, context.stop);
    if (!status.ok()) return status;
    first = run.end;
  }
  return absl::OkStatus();
}

// Reads a target back, resolved to the image's size where sampling asks for it.
absl::StatusOr<Image> ReadResolved(const DrawContext& context, const gl::Texture& samples) {
  const Sampling& sampling = context.request.scene.sampling;
  if (sampling.supersample == 1 && sampling.downsample == 1) return ReadTexture(samples);
  const glm::ivec2& window = context.plan.window_size;
  const glm::ivec2& composite = context.plan.composite_size;
  const Band whole{{0, 0, window.x, window.y}, {0, 0, composite.x, composite.y}};
  absl::StatusOr<gl::Texture> pixels =
      ResolveSamples(context.gpu, samples, sampling, whole, composite);
  if (!pixels.ok()) return pixels.status();
  return ReadTexture(*pixels);
}

absl::Status ReadTargets(const DrawContext& context, const std::vector<TileLight>& lights,
                         const TileTargets& targets, DrawnImages& drawn) {
  absl::StatusOr<Image> beauty = ReadResolved(context, targets.beauty);
  if (!beauty.ok()) return beauty.status();
  drawn.beauty = *std::move(beauty);
  if (targets.depth) {
    absl::StatusOr<Image> depth = ReadResolved(context, targets.depth);
    if (!depth.ok()) return depth.status();
    drawn.depth = *std::move(depth);
  }
  for (size_t slot = 0; slot < targets.transmittance.size(); ++slot) {
    if (!targets.transmittance[slot]) continue;
    absl::StatusOr<Image> transmittance = ReadResolved(context, targets.transmittance[slot]);
    if (!transmittance.ok()) return transmittance.status();
    drawn.transmittance[static_cast<size_t>(lights[slot].light)] = *std::move(transmittance);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DrawnFrame> DrawOnDevice(const DrawContext& context,
                                        const DeviceFrameSettings& settings) {
  const FrameRequest& request = context.request;
  const Scene& scene = request.scene;
  const size_t lights = scene.lights.size();
  if (absl::Status status = CheckTargetSize(context); !status.ok()) return status;
  gl::ForgetErrors();
  DrawnImages drawn;
  drawn.transmittance.resize(lights);
  drawn.shadows.resize(lights);
  DrawnFrame frame;
  frame.reports.resize(lights);

  // Bring the particles to the device.
  context.clock.BeginGpu("upload");
  const auto buffers = ParticlesOnDevice(context.cache, scene, context.particles);
  if (!buffers.ok()) return buffers.status();

  // Sweep every light that casts shadows through them.
  context.clock.BeginGpu("light");
  std::vector<std::optional<DeviceLightFit>> fits(lights);
  std::vector<const DeviceLightFit*> fit_of(lights, nullptr);
  for (size_t l = 0; l < lights; ++l) {
    if (!scene.lights[l].casts_shadows()) continue;
    absl::StatusOr<DeviceLightFit> fit = FitLightOnDevice(
        context.gpu, scene.lights[l], context.particles, **buffers, scene.material.profile,
        context.plan.light_buffer_size, scene.shadow.fit_degree, context.stop,
        LightSweepSettingsFor(context.device));
    if (!fit.ok()) return fit.status();
    frame.reports[l] = ReportOf(fit->projection);
    if (ShowsOfLight(request, ImageKind::kLightBuffer, l))
      drawn.shadows[l].light_buffer = ReadOpticalDepth(*fit);
    fits[l] = *std::move(fit);
    fit_of[l] = &*fits[l];
  }

  // See the particles from the eye, in the light.
  context.clock.BeginGpu("project");
  const TargetProjection eye =
      UploadProjection(EyeProjection(scene, context.plan.composite_size), context.particles);
  const absl::StatusOr<DeviceSprites> sprites = ListDeviceSprites(
      context.gpu, **buffers, context.particles.set().origin, eye.projection, NearDepth(scene));
  if (!sprites.ok()) return sprites.status();
  const std::vector<int> shown =
      ShownSlots(request, ListTileLights(scene, /*keep_transmittance=*/true));
  const ShadedLayout layout = LayOutShading(scene, *sprites, scene.shadow.fit_degree,
                                            context.plan.keep_depth, !shown.empty());
  const TileTargets targets = MakeTileTargets(eye.projection.size, layout, shown);
  absl::Status status = CompositeRuns(context, {**buffers, eye, *sprites, fit_of, layout},
                                      settings.most_run_bytes, targets);
  if (!status.ok()) return status;

  context.clock.BeginCpu("readback");
  status = ReadTargets(context, layout.lights, targets, drawn);
  if (!status.ok()) return status;
  if (status = gl::CheckErrors("frame"); !status.ok()) return status;
  context.clock.BeginCpu("images");
  frame.images = SelectImages(request, std::move(drawn));
  return frame;
}

}  // namespace halflight::sweep
