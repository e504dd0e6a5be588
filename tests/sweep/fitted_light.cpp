#include "tests/sweep/fitted_light.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "renderer/sweep/polynomial.h"
#include "renderer/sweep/sprites.h"

namespace halflight::sweep {

namespace {

double ValueAt(int degree, const float* p, double x, double y) {
  double value = 0.0;
  for (int a = 0; a <= degree; ++a) {
    for (int b = 0; a + b <= degree; ++b) {
      value += p[TermIndex(degree, a, b)] * std::pow(x, a) * std::pow(y, b);
    }
  }
  return value;
}

double WeightAt(const Sprite& sprite, const glm::dvec2& s, const glm::dvec2& plane,
                bool orthographic, Profile profile) {
  double rho_squared = s.x * s.x + s.y * s.y;
  if (!orthographic) {
    const double turn = sprite.x * s.y - sprite.y * s.x;
    rho_squared = (rho_squared + turn * turn) / (1.0 + plane.x * plane.x + plane.y * plane.y);
  }
  const double w = std::max(0.0, 1.0 - rho_squared);
  return profile == Profile::kBall ? std::sqrt(w) : w;
}

// DiscFit::Fit() in float64.
void Solve(const std::vector<double>& inverse_gram, const std::vector<double>& weights,
           const std::vector<double>& values, float* polynomial) {
  if (weights[0] <= 0.0) return;
  const size_t terms = weights.size();
  const double mean = values[0] / weights[0];
  for (size_t i = 0; i < terms; ++i) {
    double coefficient = i == 0 ? mean : 0.0;
    for (size_t j = 0; j < terms; ++j) {
      coefficient += inverse_gram[i * terms + j] * (values[j] - mean * weights[j]) / weights[0];
    }
    polynomial[i] = static_cast<float>(coefficient);
  }
}

}  // namespace

bool FittedLight::operator==(const FittedLight& other) const {
  return depth == other.depth && behind == other.behind && sprites.size() == other.sprites.size() &&
         std::memcmp(sprites.data(), other.sprites.data(), sprites.size() * sizeof(Sprite)) == 0;
}

std::vector<Sprite> SpritesByParticle(const ParticleView& particles, const Projection& light) {
  const SpriteList list = ListSprites(particles, light);
  std::vector<Sprite> sprites(list.sprites.size());
  for (size_t place = 0; place < sprites.size(); ++place) {
    sprites[list.particles[place]] = list.sprites[place];
  }
  return sprites;
}

FittedLight FitOnCpu(const Scene& scene) {
  const ParticleView particles(scene);
  const absl::StatusOr<LightFit> fit =
      FitLight(scene, particles, PlanLight(scene, particles, 0), {});
  return {{fit->depth.begin(), fit->depth.end()},
          SpritesByParticle(particles, fit->projection),
          fit->optical_depth.pixels};
}

FittedLight FitInFloat64(const Scene& scene) {
  const int degree = scene.shadow.fit_degree;
  const auto terms = static_cast<size_t>(Terms(degree));
  const auto size = static_cast<size_t>(scene.shadow.light_buffer_size);
  const ParticleView particles(scene);
  const Projection projection =
      LightProjection(scene.lights[0], particles, static_cast<int>(size), 0.0);
  const SpriteList list = ListSprites(particles, projection);
  const DiscFit disc(scene.material.profile, degree);
  std::vector<double> behind(size * size);
  FittedLight fit;
  fit.depth.resize(particles.size() * terms);
  fit.sprites.resize(particles.size());
  for (size_t place = 0; place < particles.size(); ++place) {
    const Sprite& sprite = list.sprites[place];
    const Rect& rect = list.rects[place];
    std::vector<double> weights(terms);
    std::vector<double> values(terms);
    for (size_t y = rect.y_begin; y < rect.y_end; ++y) {
      for (size_t x = rect.x_begin; x < rect.x_end; ++x) {
        const glm::dvec2 plane =
            (glm::dvec2(x, y) + 0.5 - projection.pixel_offset) / projection.pixel_from_plane;
        const glm::dvec2 s = (plane - glm::dvec2(sprite.x, sprite.y)) * double{sprite.scale};
        const double w =
            WeightAt(sprite, s, plane, projection.orthographic, scene.material.profile);
        double& depth = behind[y * size + x];
        for (int a = 0; a <= degree; ++a) {
          for (int b = 0; a + b <= degree; ++b) {
            const auto term = static_cast<size_t>(TermIndex(degree, a, b));
            const double monomial = w * std::pow(s.x, a) * std::pow(s.y, b);
            weights[term] += monomial;
            values[term] += monomial * depth;
          }
        }
        depth += sprite.optical_depth * w;
      }
    }
    const uint32_t i = list.particles[place];
    Solve(disc.inverse_gram(), weights, values, &fit.depth[i * terms]);
    fit.sprites[i] = sprite;
  }
  fit.behind.assign(behind.begin(), behind.end());
  return fit;
}

FitDifference Between(const FittedLight& fit, const FittedLight& expected, int degree) {
  if (fit.depth.size() != expected.depth.size() || fit.behind.size() != expected.behind.size() ||
      fit.sprites.size() != expected.sprites.size()) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {kInfinity, kInfinity, kInfinity, kInfinity};
  }
  const double scale = *std::max_element(expected.behind.begin(), expected.behind.end());
  FitDifference difference;
  for (size_t i = 0; i < expected.behind.size(); ++i) {
    const double behind = std::abs(double{fit.behind[i]} - expected.behind[i]) / scale;
    difference.behind = std::max(difference.behind, behind);
  }
  for (size_t i = 0; i < expected.sprites.size(); ++i) {
    const Sprite& a = fit.sprites[i];
    const Sprite& b = expected.sprites[i];
    for (const float Sprite::*number :
         {&Sprite::x, &Sprite::y, &Sprite::scale, &Sprite::optical_depth}) {
      if (a.*number == b.*number) continue;
      difference.sprites =
          std::max(difference.sprites, std::abs(double{a.*number} / b.*number - 1.0));
    }
  }
  constexpr int kAcross = 7;  // places over the disc, along each side
  const auto terms = static_cast<size_t>(Terms(degree));
  std::vector<float> p(terms);
  size_t count = 0;
  for (size_t first = 0; first < expected.depth.size(); first += terms) {
    for (size_t i = 0; i < terms; ++i) p[i] = fit.depth[first + i] - expected.depth[first + i];
    for (int place = 0; place < kAcross * kAcross; ++place) {
      const double x = place % kAcross * 2.0 / (kAcross - 1) - 1.0;
      const double y = place / kAcross * 2.0 / (kAcross - 1) - 1.0;
      if (x * x + y * y > 1.0) continue;
      const double error = ValueAt(degree, p.data(), x, y) / scale;
      difference.rms += error * error;
      difference.largest = std::max(difference.largest, std::abs(error));
      ++count;
    }
  }
  difference.rms = std::sqrt(difference.rms / static_cast<double>(std::max<size_t>(count, 1)));
  return difference;
}

}  // namespace halflight::sweep
