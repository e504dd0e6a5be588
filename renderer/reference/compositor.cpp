// Rays through pixels, and blending along them; see compositor.h.
#include "renderer/reference/compositor.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "renderer/reference/light_depth.h"

namespace halflight::reference {
namespace {

// What a sample's colour, coverage and relative depth may lose to what is left out.
constexpr double kTolerance = 1e-10;

// Scaled so that it is 1 for g = 0. `cosine` is of the angle between the two directions of travel.
double HenyeyGreenstein(double g, double cosine) {
  const double base = 1.0 + g * g - 2.0 * g * cosine;
  return (1.0 - g * g) / (base * std::sqrt(base));
}

// Of a white particle at x, before shadows, as light that goes on in the direction `to_eye`.
glm::dvec3 Radiance(const PassLight& lamp, double g, const glm::dvec3& x,
                    const glm::dvec3& to_eye) {
  glm::dvec3 radiance(lamp.light.color);
  if (g != 0.0) radiance *= HenyeyGreenstein(g, glm::dot(lamp.rays.DirectionAt(x), to_eye));
  const auto* point = std::get_if<PointLight>(&lamp.light.kind);
  if (point != nullptr && point->inverse_square_falloff) {
    const double distance = lamp.rays.DepthOf(x);
    radiance /= distance * distance;
  }
  return radiance;
}

double LargestOf(const glm::dvec3& color) {
  return std::max({std::abs(color.x), std::abs(color.y), std::abs(color.z)});
}

// The most that a particle can add to a sample in this pass: x_i lies within its radius.
double BrightestOf(const Particle& particle, const Pass& pass, const Material& material) {
  const double g = std::abs(static_cast<double>(material.phase_g));
  double light = 0.0;
  for (const PassLight& lamp : pass.lights) {
    double most = LargestOf(glm::dvec3(lamp.light.color)) * HenyeyGreenstein(g, 1.0);
    const auto* point = std::get_if<PointLight>(&lamp.light.kind);
    if (point != nullptr && point->inverse_square_falloff) {
      const double nearest = std::max(0.0, lamp.rays.DepthOf(particle.center) - particle.radius);
      most /= nearest * nearest;
    }
    if (most > 0.0) light += most;
  }
  if (pass.ambient_and_emission) light += LargestOf(glm::dvec3(material.ambient));
  double brightest = LargestOf(particle.color) * light;
  if (pass.ambient_and_emission) brightest += LargestOf(particle.emission);
  return std::isnan(brightest) ? std::numeric_limits<double>::infinity() : brightest;
}

std::vector<float> BrightestOfAll(const Cloud& cloud, const Pass& pass, const Material& material) {
  std::vector<float> brightest;
  brightest.reserve(cloud.particles.size());
  for (const Particle& particle : cloud.particles) {
    // Rounded up.
    brightest.push_back(static_cast<float>(1.000001 * BrightestOf(particle, pass, material)));
  }
  return brightest;
}

// The optical depth behind which a light that can add `brightest` adds less than the tolerance.
double EnoughDepth(const Light& light, double brightest) {
  double least_density = std::numeric_limits<double>::infinity();
  for (int channel = 0; channel < 3; ++channel) {
    const double density = light.shadow_density[channel];
    if (density != 0.0) least_density = std::min(least_density, density);
  }
  return std::log(std::max(1.0, brightest) / (0.1 * kTolerance)) / least_density;
}

glm::dvec3 Attenuate(const Light& light, double optical_depth) {
  if (!light.colored_density()) {
    return glm::dvec3(std::exp(-static_cast<double>(light.shadow_density.x) * optical_depth));
  }
  return glm::exp(-glm::dvec3(light.shadow_density) * optical_depth);
}

}  // namespace

// A particle on a ray.
struct Compositor::Hit {
  double distance;  // of x_i from the eye
  uint32_t particle;
  float brightest_behind;  // the most that any hit after this one can add
  double optical_depth;
};

// One pass over the hits of one ray.
class Compositor::Blending {
 public:
  Blending(const Compositor& of, const Pass& pass, const EyeRay& ray, std::vector<Hit>& hits)
      : of_(of), pass_(pass), first_(&pass == of.passes_.data()), ray_(ray), hits_(hits) {
    std::sort(hits.begin(), hits.end(), [&pass](const Hit& a, const Hit& b) {
      if (!pass.nearness.empty()) return pass.nearness[a.particle] < pass.nearness[b.particle];
      return a.distance != b.distance ? a.distance < b.distance : a.particle < b.particle;
    });
    const auto& brightest = of.brightest_[static_cast<size_t>(&pass - of.passes_.data())];
    float behind = 0.0F;
    double nearest = std::numeric_limits<double>::infinity();
    double farthest = 0.0;
    for (size_t i = hits.size(); i-- > 0;) {
      hits[i].brightest_behind = behind;
      behind = std::max(behind, brightest[hits[i].particle]);
      nearest = std::min(nearest, hits[i].distance);
      farthest = std::max(farthest, hits[i].distance);
    }
    depth_range_ = farthest / nearest;
  }

  void AddTo(PixelSample& sum, const std::stop_token& stop) const {
    const auto& brightest = of_.brightest_[static_cast<size_t>(&pass_ - of_.passes_.data())];
    double clear = 1.0;  // the product of 1 - alpha
    for (const Hit& hit : hits_) {
      if (stop.stop_requested()) return;
      const double weight = clear * -std::expm1(-hit.optical_depth);
      AddHit(hit, weight, brightest[hit.particle], sum);
      clear *= std::exp(-hit.optical_depth);
      const double can_change =
          std::max({1.0, depth_range_, static_cast<double>(hit.brightest_behind)});
      if (clear * can_change < kTolerance) return;
    }
  }

 private:
  void AddHit(const Hit& hit, double weight, double brightest, PixelSample& sum) const {
    const Particle& particle = of_.cloud_.particles[hit.particle];
    const glm::dvec3 x = ray_.origin + hit.distance * ray_.direction;
    glm::dvec3 light(0.0);
    if (pass_.ambient_and_emission) light += glm::dvec3(of_.material_.ambient);
    for (const PassLight& lamp : pass_.lights) {
      glm::dvec3 transmittance(1.0);
      if (lamp.depth) {
        transmittance =
            Attenuate(lamp.light, lamp.depth(x, hit.particle, EnoughDepth(lamp.light, brightest)));
      }
      sum.transmittance[lamp.index] += weight * transmittance;
      light += Radiance(lamp, of_.material_.phase_g, x, -ray_.direction) * transmittance;
    }
    glm::dvec3 color = particle.color * light;
    if (pass_.ambient_and_emission) color += particle.emission;
    sum.rgba += glm::dvec4(weight * color, first_ ? weight : 0.0);
    if (first_) sum.depth += weight * of_.eye_.eye.DepthOf(x);
  }

  const Compositor& of_;
  const Pass& pass_;
  bool first_;
  const EyeRay& ray_;
  const std::vector<Hit>& hits_;
  double depth_range_;
};

EyeIndex::EyeIndex(const Rays& rays, const Cloud& cloud, const std::stop_token& stop)
    : order(OrderFromLight(rays, cloud, stop)), index(rays, cloud, order, stop) {}

IndexedEye::IndexedEye(const Scene& scene, const Cloud& cloud, const std::stop_token& stop)
    : eye(scene), particles(std::make_shared<const EyeIndex>(eye.rays(), cloud, stop)) {}

Compositor::Compositor(const Scene& scene, const Cloud& cloud, IndexedEye eye,
                       std::vector<Pass> passes)
    : cloud_(cloud),
      passes_(std::move(passes)),
      light_count_(scene.lights.size()),
      material_(scene.material),
      window_(scene.camera.window),
      samples_across_(scene.sampling.supersample),
      eye_(std::move(eye)) {
  for (const Pass& pass : passes_) {
    brightest_.push_back(BrightestOfAll(cloud, pass, scene.material));
  }
}

void Compositor::FindHits(const EyeRay& ray, std::vector<Hit>& hits) const {
  hits.clear();
  const EyeIndex& eye = *eye_.particles;
  eye.index.VisitCandidates(ray.origin + ray.direction, [&](uint32_t begin, uint32_t end) {
    for (uint32_t entry = begin; entry < end; ++entry) {
      const uint32_t index = eye.order[eye.index.ranks()[entry]];
      const Particle& particle = cloud_.particles[index];
      const glm::dvec3 offset = particle.center - ray.origin;
      const double along = glm::dot(offset, ray.direction);
      if (along <= 0.0) continue;
      const glm::dvec3 across = offset - along * ray.direction;
      const double squared_impact = glm::dot(across, across);
      if (squared_impact >= particle.radius * particle.radius) continue;
      const double depth = OpticalDepthAt(particle, cloud_.profile, squared_impact);
      if (depth > 0.0) hits.push_back({along, index, 0.0F, depth});
    }
  });
}

void Compositor::AddSample(const EyeRay& ray, std::vector<Hit>& hits, PixelSample& sum,
                           const std::stop_token& stop) const {
  FindHits(ray, hits);
  for (const Pass& pass : passes_) Blending(*this, pass, ray, hits).AddTo(sum, stop);
}

PixelSample Compositor::Evaluate(const glm::ivec2& pixel, const std::stop_token& stop) const {
  // Kept from pixel to pixel for its memory only.
  thread_local std::vector<Hit> hits;
  const int n = samples_across_;
  PixelSample mean;
  mean.transmittance.assign(light_count_, glm::dvec3(0.0));
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      AddSample(eye_.eye.RayThrough(window_.x + pixel.x + (column + 0.5) / n,
                                    window_.y + pixel.y + (row + 0.5) / n),
                hits, mean, stop);
    }
  }
  const double scale = 1.0 / (n * n);
  mean.rgba *= scale;
  mean.depth *= scale;
  for (glm::dvec3& transmittance : mean.transmittance) transmittance *= scale;
  return mean;
}

}  // namespace halflight::reference
