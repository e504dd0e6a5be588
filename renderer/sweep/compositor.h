// The eye pass of the light sweep: tiles of the image, each walked front to back by one core.
#pragma once

#include <stop_token>
#include <vector>

#include "renderer/image.h"
#include "renderer/projection.h"
#include "renderer/sweep/shading.h"
#include "renderer/sweep/sprites.h"
#include "renderer/sweep/tiles.h"

namespace halflight::sweep {

// R G B A images of the target's size, as frame_images.h takes them.
struct Composite {
  Image beauty;
  Image depth;                       // depth * alpha, 0, 0, alpha; empty unless kept
  std::vector<Image> transmittance;  // by slot: R G B * alpha, alpha; empty unless kept
};

// Nothing covered; with transmittance for `slots` of Shading::lights. Once `stop` was requested,
// images without all of their pixels.
Composite MakeComposite(const glm::ivec2& size, bool keep_depth, size_t slots,
                        const std::stop_token& stop = {});

// Draws a shaded run behind what `composite` shows; `tiles` lists the run's rectangles. Leaves out
// of a pixel what lies behind a coverage of 1 - 1e-6, once all pixels of its tile have that: an
// error of 1e-6 times the brightest particle. False when `stop` ended it early. Any thread; uses
// all cores.
bool CompositeRun(const SpriteList& list, const TileLists& tiles, const Shading& shading,
                  const Projection& eye, Profile profile, const std::stop_token& stop,
                  Composite& composite);

}  // namespace halflight::sweep
