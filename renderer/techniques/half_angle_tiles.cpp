#include "renderer/techniques/half_angle_tiles.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "renderer/passes/composite_slices.h"
#include "renderer/passes/light_layers.h"
#include "renderer/passes/splat_tiles.h"

namespace halflight {

namespace {

// Layers of one run, at most.
constexpr size_t kMostLayerBytes = size_t{128} << 20U;

// The light of a traversal on its way through the slices.
class LightWalk {
 public:
  LightWalk(const TraversalContext& context, const SlicedLight& sliced)
      : context_(context),
        sliced_(sliced),
        slice_begins_(gl::MakeBuffer("slice begins", sliced.order.slice_begin)),
        walk_(sweep::TileWalkFor(context.device)) {
    const Traversal& traversal = context.traversal;
    const int size = traversal.light_buffer_size;
    buffer_ = MakeLightBuffer("light buffer", size, sliced.channels);
    next_ = MakeLightBuffer("light buffer, next", size, sliced.channels);
    const bool keeps_both = traversal.interpolate || traversal.keep_layers;
    layers_ = MakeLightLayers(size, sliced.channels, traversal.blur && keeps_both ? 2 : 1,
                              sliced.order.slice_begin.size() - 1, kMostLayerBytes);
  }

  // Valid before the first run.
  absl::Status FindRects() {
    absl::StatusOr<SplatRects> rects =
        FindSplatRects(context_.gpu, context_.device, context_.buffers, sliced_.splats,
                       sliced_.light.block, sliced_.light.projection.size);
    if (!rects.ok()) return rects.status();
    rects_ = *std::move(rects);
    return absl::OkStatus();
  }

  // Takes the light through the slices of `run`, which follow those of the run before.
  absl::Status Run(const SliceRun& run) {
    first_slice_ = run.first;
    SliceRun slices = run;  // that have not begun
    sweep::PlaceRun places{begins()[run.first], begins()[run.end]};
    do {
      absl::StatusOr<SplatTiles> tiles =
          ListSplatTiles(context_.gpu, rects_, places, walk_.tile_size);
      if (!tiles.ok()) return tiles.status();
      const bool last = tiles->run.end == places.end;
      if (absl::Status status = WalkList(*tiles, last, slices); !status.ok()) return status;
      places.first = tiles->run.end;
    } while (places.first < places.end);
    return absl::OkStatus();
  }

  // Valid after the last run: has the light behind all particles read back.
  absl::Status KeepBehindAll(Image& kept) {
    if (context_.traversal.blur) {
      // The buffer stands at the middle of the last slice.
      absl::Status status = sliced_.blur(sliced_.order.slice_position.back(),
                                         sliced_.order.end_position, buffer_, next_);
      if (!status.ok()) return status;
    }
    context_.readback.Copy(buffer_.texture, {kept});
    return absl::OkStatus();
  }

  [[nodiscard]] const LightLayers& layers() const { return layers_; }
  [[nodiscard]] const gl::Buffer& slice_begins() const { return slice_begins_; }

 private:
  [[nodiscard]] const std::vector<uint32_t>& begins() const { return sliced_.order.slice_begin; }

  // Walks the places of a list, the last of the run or not, dispatch by dispatch; slices that begin
  // meanwhile leave `slices`.
  absl::Status WalkList(const SplatTiles& tiles, bool last, SliceRun& slices) {
    const DepositPass pass{sliced_.splats,   sliced_.light, context_.scene.material.profile,
                           sliced_.channels, slice_begins_, walk_};
    size_t at = tiles.run.first;
    do {
      if (context_.stop.stop_requested()) return absl::CancelledError("frame cancelled");
      size_t end = std::min(at + MostPlacesOfDeposit(walk_), tiles.run.end);
      const size_t first = slices.first;
      if (context_.traversal.blur) {
        // One slice at a time, the light spread up to it.
        if (slices.first < slices.end && begins()[slices.first] == at) {
          if (absl::Status status = BlurUpTo(slices.first); !status.ok()) return status;
          ++slices.first;
        }
        end = std::min<size_t>(end, begins()[slices.first]);
      } else {
        const bool to_the_end = last && end == tiles.run.end;
        while (slices.first < slices.end && (begins()[slices.first] < end || to_the_end)) {
          ++slices.first;
        }
      }
      absl::Status status =
          DepositPlaces(context_.gpu, pass, tiles.lists, {at, end}, {first, slices.first},
                        first_slice_, buffer_, next_, layers_);
      if (!status.ok()) return status;
      std::swap(buffer_, next_);
      at = end;
    } while (at < tiles.run.end || (last && slices.first < slices.end));
    return absl::OkStatus();
  }

  absl::Status BlurUpTo(size_t slice) {
    if (slice == 0) return absl::OkStatus();
    const std::vector<double>& positions = sliced_.order.slice_position;
    return sliced_.blur(positions[slice - 1], positions[slice], buffer_, next_);
  }

  const TraversalContext& context_;
  const SlicedLight& sliced_;
  gl::Buffer slice_begins_;
  sweep::TileWalk walk_;
  SplatRects rects_;
  size_t first_slice_ = 0;  // of the run
  // What the particles so far left, and room for what comes next.
  LightBuffer buffer_;
  LightBuffer next_;
  LightLayers layers_;
};

absl::StatusOr<std::vector<SplatRects>> FindEyeRects(const TraversalContext& context,
                                                     const CompositePass& composite) {
  std::vector<SplatRects> all;
  for (const CompositeTarget& target : context.targets) {
    absl::StatusOr<SplatRects> rects =
        FindSplatRects(context.gpu, context.device, context.buffers, composite.eye_splats,
                       target.projection, {target.image.width(), target.image.height()});
    if (!rects.ok()) return rects.status();
    all.push_back(*std::move(rects));
  }
  return all;
}

// Composites places over all targets.
absl::Status CompositePlaces(const TraversalContext& context, const CompositePass& composite,
                             const std::vector<SplatRects>& rects, const sweep::PlaceRun& places,
                             const LayeredLight* light) {
  const sweep::TileWalk walk = sweep::TileWalkFor(context.device);
  for (size_t t = 0; t < context.targets.size(); ++t) {
    for (sweep::PlaceRun left = places; left.first < left.end;) {
      absl::StatusOr<SplatTiles> tiles =
          ListSplatTiles(context.gpu, rects[t], left, walk.tile_size);
      if (!tiles.ok()) return tiles.status();
      absl::Status status = CompositeSlices(context.gpu, composite, tiles->lists, tiles->run, light,
                                            walk, context.targets[t], context.stop);
      if (!status.ok()) return status;
      left.first = tiles->run.end;
    }
  }
  return absl::OkStatus();
}

// Has the light behind each slice of a run read back.
void KeepLayers(const TraversalContext& context, const LightWalk& light, const SliceRun& run,
                Image& kept) {
  for (size_t s = run.first; s < run.end; ++s) {
    const auto layer = static_cast<int>((s - run.first) * light.layers().step + 1);
    context.readback.Copy(light.layers().texture, {.image = kept, .layer = static_cast<int>(s)},
                          layer);
  }
}

}  // namespace

PlannedPass DescribeCompositeInTiles() { return {"composite slices in tiles", "the image", 1}; }

absl::Status DrawSlicesInTiles(const TraversalContext& context, const SlicedLight& sliced,
                               ShadowResult& shadow) {
  const Traversal& traversal = context.traversal;
  const std::vector<uint32_t>& begins = sliced.order.slice_begin;
  const size_t slices = begins.size() - 1;
  LightWalk light(context, sliced);
  if (absl::Status status = light.FindRects(); !status.ok()) return status;
  const absl::StatusOr<std::vector<SplatRects>> eye_rects = FindEyeRects(context, sliced.composite);
  if (!eye_rects.ok()) return eye_rects.status();
  shadow.light_layers = DescribeLightImage(traversal, static_cast<int>(slices));
  for (SliceRun run; run.first < slices; run.first = run.end) {
    run.end = std::min(run.first + light.layers().slices, slices);
    context.clock.BeginGpu("light");
    if (absl::Status status = light.Run(run); !status.ok()) return status;
    if (traversal.keep_layers) KeepLayers(context, light, run, shadow.light_layers);
    context.clock.BeginGpu("composite");
    const LayeredLight layered{light.layers(), light.slice_begins(), run};
    absl::Status status = CompositePlaces(context, sliced.composite, *eye_rects,
                                          {begins[run.first], begins[run.end]}, &layered);
    if (!status.ok()) return status;
  }
  if (!traversal.keep_light_buffer) return absl::OkStatus();
  shadow.light_buffer = DescribeLightImage(traversal, 1);
  return light.KeepBehindAll(shadow.light_buffer);
}

absl::Status DrawUnshadowedInTiles(const TraversalContext& context,
                                   const CompositePass& composite) {
  const absl::StatusOr<std::vector<SplatRects>> rects = FindEyeRects(context, composite);
  if (!rects.ok()) return rects.status();
  context.clock.BeginGpu("composite");
  return CompositePlaces(context, composite, *rects, {0, composite.order.count()}, nullptr);
}

Image DescribeLightImage(const Traversal& traversal, int layers) {
  Image image{traversal.light_buffer_size, traversal.light_buffer_size, layers, {"Y"}, {}};
  if (traversal.colored_light_buffer) image.channels = {"R", "G", "B"};
  return image;
}

}  // namespace halflight
