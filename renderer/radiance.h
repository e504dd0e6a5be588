// A light's radiance, as far as it is known without looking at any place. Shadows are not part of
// it.
#pragma once

#include <variant>

#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include "renderer/scene.h"
#include "shaders/bindings.h"

namespace halflight {

// Whether the light's radiance, shadows aside, depends on the ray or on the place.
inline bool RadianceVaries(const Light& light, const Material& material) {
  const auto* point = std::get_if<PointLight>(&light.kind);
  return material.phase_g != 0.0F || (point != nullptr && point->inverse_square_falloff);
}

// For RadianceFactor of shaders/radiance.glsl.
inline shader::LightBlock DescribeLight(const Light& light, const glm::dmat4& view_from_world) {
  shader::LightBlock block;
  block.color = glm::vec4(light.color, 0.0F);
  if (const auto* directional = std::get_if<DirectionalLight>(&light.kind)) {
    block.vector = glm::vec4(glm::dmat3(view_from_world) * directional->direction, 0.0F);
  } else {
    const auto& point = std::get<PointLight>(light.kind);
    block.vector = view_from_world * glm::dvec4(point.position, 1.0);
    block.color.w = point.inverse_square_falloff ? 1.0F : 0.0F;
  }
  return block;
}

}  // namespace halflight
