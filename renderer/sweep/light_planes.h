// The light buffer of a sweep: what the light has met so far, texel by texel, and how it spreads
// there.
#pragma once

#include <stop_token>
#include <vector>

#include <glm/vec3.hpp>

#include "renderer/block_cache.h"
#include "renderer/image.h"
#include "renderer/light_spread.h"

namespace halflight::sweep {

struct LightPlanes {
  // Of `size` texels along each side that have met nothing: one optical depth, or one for each
  // colour; `unscattered`: beside it that of the light which has not been scattered.
  LightPlanes(int texels, bool colored, bool unscattered);

  int size;
  // Floats from row to row, whole vectors; those beyond the size are 0.
  int pitch;
  std::vector<std::vector<float>> depth;
  std::vector<float> unscattered;  // empty: not kept

  // Y, or R G B.
  [[nodiscard]] Image ToImage() const;
  // The same, where the planes are done with.
  [[nodiscard]] Image TakeImage() &&;
};

// Spreads the light, or where the unscattered light is kept, what is scattered, as
// shaders/blur.frag does; `density` is the light's shadow density, red alone for planes without
// colours. A colour that nothing attenuates stays as it is. Uses all cores. Once `stop` says so the
// planes are anything.
void BlurPlanes(const BlurVariance& variance, const glm::vec3& density, LightPlanes& planes,
                const std::stop_token& stop = {});

}  // namespace halflight::sweep
