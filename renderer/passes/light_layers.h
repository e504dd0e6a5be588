// The light buffers that a run of slices sees, in the layers of an array texture, and the pass that
// fills them by tiles of the light buffer: no blend unit takes part.
#pragma once

#include "absl/status/status.h"
#include "renderer/gpu.h"
#include "renderer/passes/light_buffer.h"
#include "renderer/passes/project.h"
#include "renderer/sweep/device/compositor.h"
#include "renderer/sweep/device/lists.h"

namespace halflight {

// Slices of an order, [first, end).
struct SliceRun {
  size_t first = 0;
  size_t end = 0;
};

// Slice s of a run sees layer (s - run.first) * step; the layer after that has it deposited too.
// Where light is blurred between slices and both are needed, they differ from what the next slice
// sees: then step is 2.
struct LightLayers {
  gl::Texture texture;
  size_t step = 1;
  size_t slices = 0;  // that it holds
};

// For `slices` slices, or as many of them as take no more than `most_bytes` and the device's
// layers, but at least one.
LightLayers MakeLightLayers(int size, const LightChannels& channels, size_t step, size_t slices,
                            size_t most_bytes);

// What stays the same from dispatch to dispatch.
struct DepositPass {
  const gl::Buffer& splats;  // the light's
  const TargetProjection& light;
  Profile profile;
  LightChannels channels;
  const gl::Buffer& slice_begins;  // uint[slices + 1]: places
  sweep::TileWalk walk;
};

// Places that one dispatch may take.
size_t MostPlacesOfDeposit(const sweep::TileWalk& walk);

// Adds the places to what `from` holds, in their order, into `to`: sums are those of DepositSlice,
// bit for bit where blending adds float32 in order. Of `slices`, those that begin at these places,
// each gets what was there before it into its layer of `layers`, whose first slice is
// `first_slice`; the last slice that has begun, what is there at the end into the layer after its
// own. `tiles` are lists that have these places.
absl::Status DepositPlaces(Gpu& gpu, const DepositPass& pass, const sweep::DeviceTiles& tiles,
                           const sweep::PlaceRun& places, const SliceRun& slices,
                           size_t first_slice, const LightBuffer& from, const LightBuffer& to,
                           const LightLayers& layers);

}  // namespace halflight
