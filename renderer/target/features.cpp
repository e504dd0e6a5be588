#include "renderer/target/features.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>

#include "renderer/particle_view.h"
#include "renderer/projection.h"

namespace halflight {

namespace {

constexpr size_t kSampledParticles = 8192;
constexpr double kLargestRadius = 1e5;  // pixels; a particle round the eye has no size

// Sprites' quads on a target, clipped to it, in its pixels.
struct Footprints {
  double area = 0.0;
  double square_radius = 0.0;  // mean over the quads that reach the target
};

Footprints Project(const Projection& projection, const ParticleView& particles) {
  const size_t stride = 1 + particles.size() / kSampledParticles;
  const glm::dmat3 rotation(projection.view_from_world);
  const glm::dvec3 origin_from_eye = particles.set().origin - projection.eye();
  const glm::dvec2 size(projection.size);
  const double scale = std::abs(projection.pixel_from_plane.x);
  Footprints sum;
  double seen = 0.0;
  for (size_t i = 0; i < particles.size(); i += stride) {
    const glm::dvec3 view = rotation * (glm::dvec3(particles.positions()[i]) + origin_from_eye);
    const double radius = particles.radius(i);
    if (!projection.orthographic && view.z > radius) continue;  // behind the eye
    const double distance = projection.orthographic ? 1.0 : std::max(-view.z, 1e-3 * radius);
    const glm::dvec2 center =
        glm::dvec2(view) / distance * projection.pixel_from_plane + projection.pixel_offset;
    const double reach = std::min(radius / distance * scale, kLargestRadius);
    const glm::dvec2 extent =
        glm::min(center + reach, size) - glm::max(center - reach, glm::dvec2(0.0));
    if (!(extent.x > 0.0 && extent.y > 0.0)) continue;
    sum.area += extent.x * extent.y;
    sum.square_radius += reach * reach;
    seen += 1.0;
  }
  sum.area *= static_cast<double>(stride);
  if (seen > 0.0) sum.square_radius /= seen;
  return sum;
}

double MeanOpticalDepth(const ParticleView& particles) {
  if (particles.size() == 0) return 0.0;
  const size_t stride = 1 + particles.size() / kSampledParticles;
  double sum = 0.0;
  double count = 0.0;
  for (size_t i = 0; i < particles.size(); i += stride) {
    sum += particles.optical_depth(i);
    count += 1.0;
  }
  return sum / count;
}

// Mean of the profile over a sprite's quad.
double MeanProfile(Profile profile) {
  return std::numbers::pi / 4.0 * (profile == Profile::kSoft ? 1.0 / 2.0 : 2.0 / 3.0);
}

// Half-angle slicing needs such a light outside the cloud; bounds of the largest particles serve.
bool IsAmong(const PointLight& light, const ParticleView& particles) {
  const OffsetBounds& bounds = particles.bounds();
  const glm::dvec3 center = particles.set().origin + bounds.center();
  return glm::distance(light.position, center) <=
         0.5 * glm::distance(bounds.low, bounds.high) + particles.largest_radius();
}

LightFeatures FeaturesOf(const Light& light, const Scene& scene, const ParticleView& particles,
                         double optical_depth) {
  constexpr int kTexels = 1024;
  const glm::dvec3 view = -glm::normalize(glm::dvec3(glm::row(scene.camera.view_from_world, 2)));
  LightFeatures features;
  features.share = static_cast<double>(light.color.x + light.color.y + light.color.z);
  const auto* const point = std::get_if<PointLight>(&light.kind);
  features.among_particles = point != nullptr && IsAmong(*point, particles);
  if (particles.size() == 0) return features;
  // Seen from a light among them the particles fill no one buffer; along an axis they do.
  const Light seen_by = features.among_particles ? Light{} : light;
  features.cosine = glm::dot(view, TravelDirection(seen_by, particles));
  const Footprints footprints =
      Project(LightProjection(seen_by, particles, kTexels, 0.0), particles);
  features.quad_area = footprints.area / (1.0 * kTexels * kTexels);
  features.radius = std::sqrt(footprints.square_radius) / kTexels;
  const glm::vec3& density = light.shadow_density;
  features.depth = std::max({density.x, density.y, density.z}) * optical_depth *
                   MeanProfile(scene.material.profile) * features.quad_area;
  return features;
}

}  // namespace

SceneFeatures FeaturesOf(const Scene& scene) {
  const ParticleView particles(scene);
  const PixelRect& window = scene.camera.window;
  const double rate = scene.sampling.supersample;
  SceneFeatures features;
  features.particles = static_cast<double>(particles.size());
  features.pixels = 1.0 * window.width * window.height;
  features.samples = features.pixels * rate * rate;
  features.optical_depth = MeanOpticalDepth(particles);
  const Footprints footprints =
      Project(EyeProjection(scene.camera, {window.width, window.height}, 1.0), particles);
  features.quad_samples = footprints.area * rate * rate;
  features.radius_samples = std::sqrt(footprints.square_radius) * rate;

  features.scatters = scene.scatters();

  double light_sum = 0.0;
  for (const Light& light : scene.lights) {
    light_sum += static_cast<double>(light.color.x + light.color.y + light.color.z);
    if (!light.casts_shadows()) continue;
    features.lights.push_back(FeaturesOf(light, scene, particles, features.optical_depth));
  }
  for (LightFeatures& light : features.lights) {
    light.share = light_sum > 0.0 ? light.share / light_sum : 0.0;
  }
  return features;
}

double ReferenceWork(const Scene& scene, double pixels) {
  constexpr double kLeastSamples = 65536.0;
  const double samples = pixels * scene.sampling.supersample * scene.sampling.supersample;
  return std::max(kLeastSamples, samples) * static_cast<double>(scene.particles->size());
}

}  // namespace halflight
