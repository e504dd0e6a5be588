// The eye pass of the light sweep: tiles of the image, each walked front to back by one core.
#pragma once

#include <stop_token>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/image.h"
#include "renderer/projection.h"
#include "renderer/sweep/shading.h"
#include "renderer/sweep/sprites.h"

namespace halflight::sweep {

// R G B A images of the target's size, as frame_images.h takes them.
struct Composite {
  Image beauty;
  Image depth;                       // depth * alpha, 0, 0, alpha; empty unless shaded
  std::vector<Image> transmittance;  // by slot: R G B * alpha, alpha; empty unless wanted
};

// Leaves out of a pixel what lies behind a coverage of 1 - 1e-6, once all pixels of its tile have
// that: an error of 1e-6 times the brightest particle. Cancelled when `stop` says so. Any thread;
// uses all cores.
absl::StatusOr<Composite> CompositeTiles(const SpriteList& list, const Shading& shading,
                                         const Projection& eye, Profile profile,
                                         bool keep_transmittance, const std::stop_token& stop);

}  // namespace halflight::sweep
