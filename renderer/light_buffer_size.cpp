#include "renderer/light_buffer_size.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <glm/matrix.hpp>

#include "renderer/projection.h"

namespace halflight {

namespace {

constexpr int kSlicedSize = 512;
constexpr int kLeastSize = 64;
constexpr int kMostSize = 1024;
constexpr int kStep = 64;  // tiles of the light sweep

// Texels that a typical particle's radius shall take at least: where the curves of error against
// size level off, see docs/target-error.md.
constexpr double kTexelsPerRadius = 5.5;
// Part of the cloud's optical depth times area that may lie in particles smaller than that.
constexpr double kSmallPart = 0.1;
constexpr size_t kSampledParticles = 4096;

struct Sample {
  double radius;  // in texels
  double weight;
};

// The radius below which `part` of the weight lies. `sample` is not empty.
double WeightedQuantile(std::vector<Sample> sample, double part) {
  std::sort(sample.begin(), sample.end(),
            [](const Sample& a, const Sample& b) { return a.radius < b.radius; });
  double total = 0.0;
  for (const Sample& one : sample) total += one.weight;
  double sum = 0.0;
  for (const Sample& one : sample) {
    sum += one.weight;
    if (sum > part * total) return one.radius;
  }
  return sample.back().radius;
}

// Of a typical particle in a buffer of kMostSize, along the side where it takes fewer texels.
double TypicalRadius(const Light& light, const ParticleView& particles) {
  const Projection projection = LightProjection(light, particles, kMostSize, 0.0);
  const glm::dmat3 rotation(projection.view_from_world);
  const glm::dvec3 origin_from_light = particles.set().origin - projection.eye();
  const double texels_per_unit =
      std::min(std::abs(projection.pixel_from_plane.x), std::abs(projection.pixel_from_plane.y));
  const size_t stride = 1 + particles.size() / kSampledParticles;
  std::vector<Sample> sample;
  for (size_t i = 0; i < particles.size(); i += stride) {
    const double radius = particles.radius(i);
    double distance = 1.0;
    if (!projection.orthographic) {
      const glm::dvec3 offset(particles.positions()[i]);
      distance = std::max(-(rotation * (offset + origin_from_light)).z, radius);
    }
    sample.push_back({radius / distance * texels_per_unit,
                      radius * radius * static_cast<double>(particles.optical_depth(i))});
  }
  return WeightedQuantile(std::move(sample), kSmallPart);
}

bool IsSizedByParticles(ShadowTechniqueKind technique) {
  return technique == ShadowTechniqueKind::kLightSweep ||
         technique == ShadowTechniqueKind::kParticleShadowMap;
}

}  // namespace

int LightBufferSizeFor(const Scene& scene, const ParticleView& particles) {
  const ShadowSettings& shadow = scene.shadow;
  const int most = LargestLightBufferSize(shadow, shadow.technique);
  if (shadow.light_buffer_size > 0 || !IsSizedByParticles(shadow.technique)) {
    return most;
  }
  double wanted = kLeastSize;
  for (const Light& light : scene.lights) {
    if (!light.casts_shadows() || particles.size() == 0) continue;
    wanted = std::max(wanted, kMostSize * kTexelsPerRadius / TypicalRadius(light, particles));
  }
  if (wanted >= most) return most;
  return std::min(static_cast<int>(std::ceil(wanted / kStep)) * kStep, most);
}

int LargestLightBufferSize(const ShadowSettings& shadow, ShadowTechniqueKind technique) {
  if (shadow.light_buffer_size > 0) return shadow.light_buffer_size;
  return std::min(IsSizedByParticles(technique) ? kMostSize : kSlicedSize,
                  shadow.max_light_buffer_size);
}

}  // namespace halflight
