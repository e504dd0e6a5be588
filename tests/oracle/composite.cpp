// Rays through pixels, and blending along them; see composite.h.
#include "tests/oracle/composite.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <thread>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace halflight::oracle {
namespace {

// What lies behind this much transparency cannot change a pixel visibly: a millionth of what tests
// look for.
constexpr double kOpaque = 1e-11;

struct EyeRay {
  glm::dvec3 origin;
  glm::dvec3 direction;
};

// A particle on a ray.
struct Hit {
  uint32_t particle;
  double distance;  // of x_i from the eye
  double alpha;
};

struct Sample {
  glm::dvec4 rgba{0.0};
  double depth{0.0};              // times coverage
  glm::dvec3 transmittance{0.0};  // times coverage
};

double HenyeyGreenstein(double g, double cosine) {
  const double base = 1.0 + g * g - 2.0 * g * cosine;
  return (1.0 - g * g) / (base * std::sqrt(base));
}

class Compositor {
 public:
  Compositor(const Scene& scene, const Cloud& cloud, const std::vector<Pass>& passes)
      : scene_(scene),
        cloud_(cloud),
        passes_(passes),
        eye_(EyePosition(scene)),
        forward_(ViewDirection(scene.camera)),
        every_particle_(AllOf(cloud)),
        index_(orthographic() ? Rays::Along(forward_) : Rays::From(eye_), cloud, every_particle_) {}

  // At a place in the whole image, in pixels from its top left corner.
  [[nodiscard]] Sample Evaluate(double x, double y) const {
    const EyeRay ray = RayThrough(x, y);
    std::vector<Hit> hits = FindHits(ray);
    Sample sample;
    for (const Pass& pass : passes_) {
      SortNearestFirst(pass, hits);
      Blend(pass, &pass == passes_.data(), ray, hits, sample);
    }
    return sample;
  }

 private:
  static std::vector<uint32_t> AllOf(const Cloud& cloud) {
    std::vector<uint32_t> indices(cloud.particles.size());
    std::iota(indices.begin(), indices.end(), 0U);
    return indices;
  }

  [[nodiscard]] bool orthographic() const {
    return std::holds_alternative<Orthographic>(scene_.camera.projection);
  }

  [[nodiscard]] EyeRay RayThrough(double x, double y) const {
    const Camera& camera = scene_.camera;
    const glm::dmat3 world_from_view = glm::transpose(glm::dmat3(camera.view_from_world));
    // From -1 to 1 over the height, to the right and up.
    const double right = (2.0 * x - camera.width) / camera.height;
    const double up = (camera.height - 2.0 * y) / camera.height;
    if (const auto* flat = std::get_if<Orthographic>(&camera.projection)) {
      const glm::dvec3 across = world_from_view * glm::dvec3(right, up, 0.0);
      return {eye_ + across * (flat->height / 2.0), forward_};
    }
    const double slope = std::tan(std::get<Perspective>(camera.projection).vertical_fov / 2.0);
    return {eye_, glm::normalize(world_from_view * glm::dvec3(right * slope, up * slope, -1.0))};
  }

  [[nodiscard]] std::vector<Hit> FindHits(const EyeRay& ray) const {
    std::vector<Hit> hits;
    for (const uint32_t index : index_.Candidates(ray.origin + ray.direction)) {
      const Particle& particle = cloud_.particles[index];
      const glm::dvec3 offset = particle.center - ray.origin;
      const double along = glm::dot(offset, ray.direction);
      if (along <= 0.0) continue;
      const glm::dvec3 across = offset - along * ray.direction;
      const double depth = OpticalDepthAt(particle, cloud_.profile, glm::dot(across, across));
      if (depth > 0.0) hits.push_back({index, along, -std::expm1(-depth)});
    }
    return hits;
  }

  static void SortNearestFirst(const Pass& pass, std::vector<Hit>& hits) {
    std::sort(hits.begin(), hits.end(), [&pass](const Hit& a, const Hit& b) {
      if (!pass.nearness.empty()) return pass.nearness[a.particle] < pass.nearness[b.particle];
      return a.distance != b.distance ? a.distance < b.distance : a.particle < b.particle;
    });
  }

  void Blend(const Pass& pass, bool first, const EyeRay& ray, const std::vector<Hit>& hits,
             Sample& sample) const {
    double clear = 1.0;  // the product of 1 - alpha
    for (const Hit& hit : hits) {
      const double weight = clear * hit.alpha;
      const Particle& particle = cloud_.particles[hit.particle];
      const glm::dvec3 x = ray.origin + hit.distance * ray.direction;
      glm::dvec3 light(0.0);
      glm::dvec3 first_transmittance(1.0);
      if (pass.ambient_and_emission) light += glm::dvec3(scene_.material.ambient);
      for (const PassLight& lamp : pass.lights) {
        glm::dvec3 transmittance(1.0);
        if (lamp.transmittance) {
          transmittance = lamp.transmittance(x, hit.particle);
          first_transmittance = transmittance;
        }
        light += Radiance(lamp, x, ray.direction) * transmittance;
      }
      glm::dvec3 color = particle.color * light;
      if (pass.ambient_and_emission) color += particle.emission;
      sample.rgba += glm::dvec4(weight * color, first ? weight : 0.0);
      if (first) {
        sample.depth += weight * glm::dot(x - eye_, forward_);
        sample.transmittance += weight * first_transmittance;
      }
      clear *= 1.0 - hit.alpha;
      if (clear < kOpaque) break;
    }
  }

  // Of a white particle at x, towards the eye, before shadows.
  [[nodiscard]] glm::dvec3 Radiance(const PassLight& lamp, const glm::dvec3& x,
                                    const glm::dvec3& eye_direction) const {
    const double g = scene_.material.phase_g;
    glm::dvec3 radiance(lamp.light.color);
    if (g != 0.0)
      radiance *= HenyeyGreenstein(g, -glm::dot(lamp.rays.DirectionAt(x), eye_direction));
    const auto* point = std::get_if<PointLight>(&lamp.light.kind);
    if (point != nullptr && point->inverse_square_falloff) {
      const double distance = lamp.rays.DepthOf(x);
      radiance /= distance * distance;
    }
    return radiance;
  }

  const Scene& scene_;
  const Cloud& cloud_;
  const std::vector<Pass>& passes_;
  glm::dvec3 eye_;
  glm::dvec3 forward_;
  std::vector<uint32_t> every_particle_;
  RayIndex index_;
};

// The mean of n x n samples; depth and transmittance weighted by coverage.
Sample EvaluatePixel(const Compositor& compositor, const Scene& scene, const glm::ivec2& pixel) {
  const int n = scene.sampling.supersample;
  const PixelRect& window = scene.camera.window;
  Sample sum;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const Sample sample = compositor.Evaluate(window.x + pixel.x + (column + 0.5) / n,
                                                window.y + pixel.y + (row + 0.5) / n);
      sum.rgba += sample.rgba;
      sum.depth += sample.depth;
      sum.transmittance += sample.transmittance;
    }
  }
  const double coverage = sum.rgba.a;
  sum.rgba /= static_cast<double>(n * n);
  sum.depth = coverage > 0.0 ? sum.depth / coverage : std::numeric_limits<double>::infinity();
  sum.transmittance = coverage > 0.0 ? sum.transmittance / coverage : glm::dvec3(1.0);
  return sum;
}

}  // namespace

glm::dvec3 ViewDirection(const Camera& camera) {
  return glm::transpose(glm::dmat3(camera.view_from_world)) * glm::dvec3(0.0, 0.0, -1.0);
}

glm::dvec3 EyePosition(const Scene& scene) {
  const glm::dmat4& view_from_world = scene.camera.view_from_world;
  const glm::dvec3 eye =
      -(glm::transpose(glm::dmat3(view_from_world)) * glm::dvec3(view_from_world[3]));
  return scene.particles == nullptr ? eye : eye - scene.particles->origin;
}

OracleImage Composite(const Scene& scene, const Cloud& cloud, const std::vector<Pass>& passes,
                      const OracleOptions& options) {
  OracleImage image{.width = scene.camera.window.width,
                    .height = scene.camera.window.height,
                    .pixels = {},
                    .rgba = {},
                    .depth = {},
                    .transmittance = {}};
  for (int y = options.stride / 2; y < image.height; y += options.stride) {
    for (int x = options.stride / 2; x < image.width; x += options.stride) {
      image.pixels.emplace_back(x, y);
    }
  }
  const size_t count = image.pixels.size();
  image.rgba.resize(count);
  image.depth.resize(count);
  image.transmittance.resize(count);

  const Compositor compositor(scene, cloud, passes);
  std::atomic<size_t> next{0};
  const auto work = [&] {
    constexpr size_t kBatch = 64;  // pixels
    for (size_t begin = next.fetch_add(kBatch); begin < count; begin = next.fetch_add(kBatch)) {
      for (size_t i = begin; i < std::min(begin + kBatch, count); ++i) {
        const Sample pixel = EvaluatePixel(compositor, scene, image.pixels[i]);
        image.rgba[i] = pixel.rgba;
        image.depth[i] = pixel.depth;
        image.transmittance[i] = pixel.transmittance;
      }
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < options.threads; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  return image;
}

}  // namespace halflight::oracle
