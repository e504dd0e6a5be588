// What is known of a light's radiance without looking at any place. Shadows are not part of it.
#pragma once

#include <variant>

#include "renderer/scene.h"

namespace halflight {

// Whether the light's radiance, shadows aside, depends on the ray or on the place.
inline bool RadianceVaries(const Light& light, const Material& material) {
  const auto* point = std::get_if<PointLight>(&light.kind);
  return material.phase_g != 0.0F || (point != nullptr && point->inverse_square_falloff);
}

}  // namespace halflight
