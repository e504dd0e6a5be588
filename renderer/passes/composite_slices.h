// The eye pass of slices by tiles of the image, in compute (shaders/composite_slices.comp): what
// composite.h draws through the blend units, without them. Lists nothing.
#pragma once

#include <stop_token>

#include "absl/status/status.h"
#include "renderer/passes/composite.h"
#include "renderer/passes/light_layers.h"
#include "renderer/sweep/device/compositor.h"
#include "renderer/sweep/device/lists.h"

namespace halflight {

// The slices of places that are drawn, and their light.
struct LayeredLight {
  const LightLayers& layers;
  const gl::Buffer& slice_begins;  // uint[slices + 1]: places
  SliceRun run;                    // that the layers hold
};

// Composites the places that `tiles` lists, which have the walk's size, into the target: in front
// of what it holds, or behind, as the pass says. `light` is null without shadows. Cancelled when
// `stop` says so.
absl::Status CompositeSlices(Gpu& gpu, const CompositePass& pass, const sweep::DeviceTiles& tiles,
                             const sweep::PlaceRun& places, const LayeredLight* light,
                             const sweep::TileWalk& walk, const CompositeTarget& target,
                             const std::stop_token& stop);

}  // namespace halflight
