// Particles as a target sees them, in the order in which they are met.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/particle_view.h"
#include "renderer/projection.h"
#include "renderer/sweep/kernels.h"
#include "renderer/sweep/tiles.h"

namespace halflight::sweep {

struct SpriteList {
  std::vector<uint32_t> particles;  // nearest the eye or the light first; equal depths by index
  Block<Sprite> sprites;      // of those, as the next
  Block<Rect> rects;          // pixels that may lie within
  // Centres in radii of those near a perspective target's eye, whose scale is 0; empty where there
  // are none.
  std::vector<NearSprite> near;
};

// Depth is the distance of a centre along an orthographic target's axis, else from its eye.
// Particles are near whose depth is at most `near_depth` radii, and those that reach the plane
// through the eye.
SpriteList ListSprites(const ParticleView& particles, const Projection& target,
                       double near_depth = 0.0);

// Where the pixels of the target lie on its plane, from pixel (x, y) on.
PixelGrid GridFrom(const Projection& target, int x, int y);

}  // namespace halflight::sweep
