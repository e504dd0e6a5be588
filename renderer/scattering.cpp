#include "renderer/scattering.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "renderer/projection.h"

namespace halflight {

namespace {

// Layers along the light, and cells across it along each side, at most: what varies within is of
// little weight beside one width of blur for all of a layer.
constexpr size_t kLayers = 128;
constexpr size_t kCells = 32;

// Optical depth times area across the light of the particle as a whole: the integral of tau w.
double CrossSection(double optical_depth, double radius, Profile profile) {
  const double share = profile == Profile::kBall ? 2.0 / 3.0 : 1.0 / 2.0;
  return optical_depth * share * std::numbers::pi * radius * radius;
}

// Places across the light, world units at the middle of the particles.
class LightPlane {
 public:
  LightPlane(const Light& light, const ParticleView& particles)
      : center_(particles.bounds().center()), travel_(TravelDirection(light, particles)) {
    const glm::dvec3 other =
        std::abs(travel_.y) > 0.9 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
    right_ = glm::normalize(glm::cross(travel_, other));
    up_ = glm::cross(right_, travel_);
    if (const auto* point = std::get_if<PointLight>(&light.kind)) {
      distance_ = glm::distance(particles.set().origin + center_, point->position);
    }
  }

  // `offset` is from the set's origin.
  [[nodiscard]] glm::dvec2 At(const glm::vec3& offset) const {
    const glm::dvec3 place = glm::dvec3(offset) - center_;
    const glm::dvec2 across(glm::dot(place, right_), glm::dot(place, up_));
    if (distance_ == 0.0) return across;
    const double depth = distance_ + glm::dot(place, travel_);
    return depth > 0.0 ? across * (distance_ / depth) : across;
  }

 private:
  glm::dvec3 center_;
  glm::dvec3 travel_;
  glm::dvec3 right_;
  glm::dvec3 up_;
  double distance_ = 0.0;  // of a point light; 0: directional
};

// The cloud as columns along the light, cut into layers: optical depth of each.
struct LayeredColumns {
  double begin = 0.0;
  double length = 0.0;  // along the axis
  size_t columns = 1;
  std::vector<double> optical_depth;  // layer after layer
};

LayeredColumns CutIntoColumns(const ParticleView& particles, const Light& light,
                              const glm::dvec3& axis, Profile profile) {
  const LightPlane plane(light, particles);
  const glm::dvec3 center = particles.bounds().center();
  const size_t count = particles.size();
  std::vector<glm::dvec2> places(count);
  std::vector<double> positions(count);
  glm::dvec2 low(std::numeric_limits<double>::infinity());
  glm::dvec2 high = -low;
  double weight = 0.0;
  double squared_radius = 0.0;
  for (size_t i = 0; i < count; ++i) {
    places[i] = plane.At(particles.positions()[i]);
    positions[i] = glm::dot(glm::dvec3(particles.positions()[i]) - center, axis);
    low = glm::min(low, places[i]);
    high = glm::max(high, places[i]);
    const double radius = particles.radius(i);
    const double cross_section = CrossSection(particles.optical_depth(i), radius, profile);
    weight += cross_section;
    squared_radius += cross_section * radius * radius;
  }
  LayeredColumns cut;
  if (!(weight > 0.0)) return cut;
  const auto [first, last] = std::minmax_element(positions.begin(), positions.end());
  cut.begin = *first;
  cut.length = *last - *first;

  // Cells as wide as particles at least, since a particle counts where its centre lies.
  const double particle = 2.0 * std::sqrt(squared_radius / weight);
  const glm::dvec2 extent = high - low;
  const double cell = std::max(particle, std::max(extent.x, extent.y) / kCells);
  const glm::dvec2 corner = 0.5 * (low + high);
  const auto columns_wide = static_cast<size_t>(std::floor(extent.x / cell)) + 1;
  const auto columns_high = static_cast<size_t>(std::floor(extent.y / cell)) + 1;
  const glm::dvec2 start =
      corner -
      0.5 * cell * glm::dvec2(static_cast<double>(columns_wide), static_cast<double>(columns_high));
  cut.columns = columns_wide * columns_high;
  cut.optical_depth.resize(kLayers * cut.columns);
  for (size_t i = 0; i < count; ++i) {
    const glm::dvec2 at = (places[i] - start) / cell;
    const size_t column = std::min(static_cast<size_t>(at.x), columns_wide - 1) +
                          std::min(static_cast<size_t>(at.y), columns_high - 1) * columns_wide;
    const double share = cut.length > 0.0 ? (positions[i] - cut.begin) / cut.length : 0.0;
    const size_t layer = std::min(static_cast<size_t>(share * kLayers), kLayers - 1);
    cut.optical_depth[layer * cut.columns + column] +=
        CrossSection(particles.optical_depth(i), particles.radius(i), profile) / (cell * cell);
  }
  return cut;
}

// The scattered light of one colour, layer by layer: lateral variance at the layers' edges. Light
// scattered in a layer starts with the directions of one scattering, and with no covariance of
// direction and place; it is the older light's that grows and decays as Lewis 1950 says.
std::vector<double> Variances(const LayeredColumns& cut, double thickness, double density,
                              const PhysicalScattering& scattering) {
  const double g = scattering.mean_cosine;
  const double once = (1.0 - g * g) / 3.0;
  const double forward = scattering.albedo * ForwardFraction(g);
  const double lost = 1.0 - forward;
  std::vector<double> depth(cut.columns);  // before the layer
  double angular = 0.0;
  double covariance = 0.0;
  std::vector<double> variance = {0.0};
  for (size_t layer = 0; layer < kLayers; ++layer) {
    const double* const in_layer = &cut.optical_depth[layer * cut.columns];
    double older = 0.0;       // scattered before the layer, and left behind it
    double scattered = 0.0;   // all that is left behind it
    double collisions = 0.0;  // of scattered light, in the layer
    for (size_t column = 0; column < cut.columns; ++column) {
      const double before = density * depth[column];
      const double after = before + density * in_layer[column];
      const double left = std::exp(-lost * after) - std::exp(-after);
      older += std::exp(-lost * after) - std::exp(lost * (before - after) - before);
      scattered += left;
      collisions += left * (after - before);
      depth[column] += in_layer[column];
    }
    double increase = 2.0 * covariance * thickness;
    if (scattered > 0.0) {
      const double met = forward * collisions / scattered;
      const double turned = met * (1.0 - g);
      const double blunted = std::exp(-met * (1.0 - g * g));
      const double middle = 0.5 * (1.0 + blunted) * (angular - 1.0 / 3.0) + 1.0 / 3.0;
      const double kept = turned > 0.0 ? -std::expm1(-turned) / turned : 1.0;
      const double older_angular = 1.0 / 3.0 + blunted * (angular - 1.0 / 3.0);
      const double older_covariance = covariance * std::exp(-turned) + middle * kept * thickness;
      const double share = 1.0 - older / scattered;
      angular = glm::mix(older_angular, once, share);
      increase = covariance * thickness;
      covariance = glm::mix(older_covariance, 0.5 * once * thickness, share);
      increase += covariance * thickness;
    }
    variance.push_back(variance.back() + increase);
  }
  return variance;
}

}  // namespace

double ForwardFraction(double mean_cosine) {
  const double g = mean_cosine;
  if (std::abs(g) < 1e-4) return 0.5 + 0.75 * g;  // the rest is below g^3
  return 1.0 - (1.0 - g * g) / (2.0 * g) * (1.0 / std::sqrt(1.0 + g * g) - 1.0 / (1.0 + g));
}

double ForwardExtinction(const PhysicalScattering& scattering) {
  return 1.0 - scattering.albedo * ForwardFraction(scattering.mean_cosine);
}

PhysicalSpread::PhysicalSpread(const ParticleView& particles, const Light& light,
                               const glm::dvec3& axis, const PhysicalScattering& scattering,
                               Profile profile) {
  const LayeredColumns cut = CutIntoColumns(particles, light, axis, profile);
  begin_ = cut.begin;
  layer_ = cut.length / static_cast<double>(kLayers);
  if (!(layer_ > 0.0)) return;
  const double thickness = layer_ / glm::dot(TravelDirection(light, particles), axis);
  variance_.resize(kLayers + 1);
  for (glm::length_t c = 0; c < 3; ++c) {
    const std::vector<double> variance =
        Variances(cut, thickness, light.shadow_density[c], scattering);
    for (size_t edge = 0; edge <= kLayers; ++edge) variance_[edge][c] = variance[edge];
  }
}

glm::dvec3 PhysicalSpread::VarianceAt(double position) const {
  if (!(layer_ > 0.0)) return glm::dvec3(0.0);
  const double place = std::clamp((position - begin_) / layer_, 0.0, static_cast<double>(kLayers));
  const auto layer = std::min(static_cast<size_t>(place), kLayers - 1);
  return glm::mix(variance_[layer], variance_[layer + 1], place - static_cast<double>(layer));
}

}  // namespace halflight
