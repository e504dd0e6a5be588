#include "renderer/light_spread.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace halflight {

LightSpread::LightSpread(const Scene& scene, const Light& light, const ParticleView& particles,
                         const glm::dvec3& axis)
    : shadow_(scene.shadow),
      spread_(scene.material.scattering_spread),
      light_along_axis_(glm::dot(TravelDirection(light, particles), axis)),
      diameter_(glm::distance(particles.bounds().low, particles.bounds().high)) {
  if (const auto& physical = scene.material.physical_scattering) {
    physical_.emplace(particles, light, axis, *physical, scene.material.profile);
  }
}

glm::dvec3 LightSpread::Variance(double from, double to) const {
  if (physical_) return physical_->VarianceAt(to) - physical_->VarianceAt(from);
  return glm::dvec3(spread_ * spread_ * (to - from) / light_along_axis_);
}

BlurVariance LightSpread::InTexels(double from, double to,
                                   const glm::dvec2& texels_per_unit) const {
  if (shadow_.blur_mode == BlurMode::kTexelsPerSlice) {
    const double texels = shadow_.blur_texels;
    return {glm::dvec3(texels * texels), glm::dvec3(texels * texels)};
  }
  const glm::dvec3 variance = Variance(from, to);
  return {variance * texels_per_unit.x * texels_per_unit.x,
          variance * texels_per_unit.y * texels_per_unit.y};
}

double LightSpread::Border() const {
  if (shadow_.blur_mode == BlurMode::kTexelsPerSlice) return 0.0;
  const glm::dvec3 variance = physical_
                                  ? physical_->VarianceAt(std::numeric_limits<double>::infinity())
                                  : glm::dvec3(spread_ * spread_ * diameter_);
  return std::min(3.0 * std::sqrt(std::max({variance.r, variance.g, variance.b})),
                  0.25 * diameter_);
}

double ForwardExtinction(const Material& material) {
  return material.physical_scattering ? ForwardExtinction(*material.physical_scattering) : 1.0;
}

glm::dvec2 TexelsPerUnit(const Projection& light, const ParticleView& particles) {
  const glm::dvec2 texels_per_unit = glm::abs(light.pixel_from_plane);
  if (light.orthographic) return texels_per_unit;
  return texels_per_unit /
         glm::distance(particles.set().origin + particles.bounds().center(), light.eye());
}

}  // namespace halflight
