#include "renderer/sweep/shading.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "renderer/parallel.h"
#include "renderer/radiance.h"
#include "renderer/sweep/polynomial.h"

namespace halflight::sweep {

namespace {

static_assert(kMaxTileLights >= 2 * kMaxLights);
static_assert(kMaxDegree == kMaxFitDegree);

using Coefficients = std::array<float, Terms(kMaxDegree)>;

// Offsets from the centre in radii (view axes) for which scaled coordinates (1, 0) and (0, 1)
// stand, to first order: offsets are perpendicular to the ray through the centre.
struct Footprint {
  glm::dvec3 x{1.0, 0.0, 0.0};
  glm::dvec3 y{0.0, 1.0, 0.0};
};

Footprint FootprintOf(const Sprite& sprite, bool orthographic) {
  Footprint footprint;
  if (orthographic) return footprint;
  const glm::dvec3 ray(sprite.x, sprite.y, -1.0);
  const double inverse = 1.0 / glm::dot(ray, ray);
  footprint.x -= ray * (ray.x * inverse);
  footprint.y -= ray * (ray.y * inverse);
  return footprint;
}

// Henyey and Greenstein 1941, scaled so that g = 0 gives 1.
double PhaseFunction(double g, double cosine) {
  const double d = 1.0 + g * g - 2.0 * g * cosine;
  return (1.0 - g * g) / (d * std::sqrt(d));
}

// Radiance that a light would have at `at` for a ray along `ray` (both view axes, `at` from the
// eye), relative to its colour.
class RadianceFactor {
 public:
  RadianceFactor(const Light& light, const Material& material, const glm::dmat4& view_from_world)
      : g_(material.phase_g) {
    if (const auto* point = std::get_if<PointLight>(&light.kind)) {
      position_ = glm::dvec3(view_from_world * glm::dvec4(point->position, 1.0));
      point_ = true;
      falloff_ = point->inverse_square_falloff;
    } else {
      travel_ = glm::dmat3(view_from_world) * std::get<DirectionalLight>(light.kind).direction;
    }
  }

  [[nodiscard]] double operator()(const glm::dvec3& at, const glm::dvec3& ray) const {
    const glm::dvec3 travel = point_ ? at - position_ : travel_;
    const double squared = std::max(glm::dot(travel, travel), 1e-300);
    const double cosine = -glm::dot(travel, ray) / std::sqrt(squared * glm::dot(ray, ray));
    return (g_ != 0.0 ? PhaseFunction(g_, cosine) : 1.0) / (falloff_ ? squared : 1.0);
  }

 private:
  double g_;
  glm::dvec3 travel_{0.0};
  glm::dvec3 position_{0.0};
  bool point_ = false;
  bool falloff_ = false;
};

// -ln(value(x, y) / value(0, 0)) as a polynomial through values half way to the rim.
template <typename Value>
Coefficients FitExponent(const Value& value, double at_center, int degree) {
  constexpr double kStep = 0.6;
  const auto f = [&](double x, double y) {
    return -std::log(std::max(value(x * kStep, y * kStep) / at_center, 1e-30));
  };
  Coefficients fit = {};
  if (degree == 0) return fit;
  const double right = f(1, 0);
  const double left = f(-1, 0);
  const double up = f(0, 1);
  const double down = f(0, -1);
  const double x = 0.5 * (right - left);
  const double y = 0.5 * (up - down);
  fit[TermIndex(degree, 1, 0)] = static_cast<float>(x / kStep);
  fit[TermIndex(degree, 0, 1)] = static_cast<float>(y / kStep);
  if (degree == 1) return fit;
  const double xx = 0.5 * (right + left);
  const double yy = 0.5 * (up + down);
  constexpr double kSquare = kStep * kStep;
  fit[TermIndex(degree, 2, 0)] = static_cast<float>(xx / kSquare);
  fit[TermIndex(degree, 0, 2)] = static_cast<float>(yy / kSquare);
  fit[TermIndex(degree, 1, 1)] = static_cast<float>((f(1, 1) - x - y - xx - yy) / kSquare);
  return fit;
}

// How a light's scaled coordinates grow with the offset in radii (view axes), around one particle.
struct LightAxes {
  glm::dvec3 x{0.0};
  glm::dvec3 y{0.0};
};

// Turns a light's fits to the eye's axes.
class LightAxesOf {
 public:
  LightAxesOf(const Projection& light, const Projection& eye, const ParticleView& particles)
      : light_(light),
        particles_(particles),
        rotation_(light.view_from_world),
        origin_from_light_(particles.set().origin - light.eye()),
        // Rows of the rotation from the eye's view: the light's axes in the eye's.
        axes_(glm::dmat3(eye.view_from_world) * glm::transpose(rotation_)) {}

  [[nodiscard]] LightAxes operator()(uint32_t particle) const {
    const double radius = particles_.radius(particle);
    // Particles smaller than the light buffer can show lie there enlarged; see ListSprites.
    if (light_.orthographic) {
      const double radii = radius / std::max(radius, light_.least_radius);
      return {axes_[0] * radii, axes_[1] * radii};
    }
    const glm::dvec3 view =
        rotation_ * (glm::dvec3(particles_.positions()[particle]) + origin_from_light_);
    const double w = std::max(-view.z, 1e-300);
    const double radii = radius / std::max(radius, light_.least_radius * w);
    return {(axes_[0] + axes_[2] * (view.x / w)) * radii,
            (axes_[1] + axes_[2] * (view.y / w)) * radii};
  }

 private:
  const Projection& light_;
  const ParticleView& particles_;
  glm::dmat3 rotation_;
  glm::dvec3 origin_from_light_;
  glm::dmat3 axes_;
};

Rgb ToRgb(const glm::vec3& color) { return {color.x, color.y, color.z}; }

}  // namespace

std::vector<TileLight> ListTileLights(const Scene& scene, bool keep_transmittance) {
  std::vector<TileLight> lights;
  std::vector<TileLight> for_transmittance;
  for (size_t l = 0; l < scene.lights.size(); ++l) {
    const bool shadowed = scene.lights[l].casts_shadows();
    const bool varies = RadianceVaries(scene.lights[l], scene.material);
    const auto index = static_cast<int>(l);
    if (shadowed || varies) lights.push_back({index, shadowed, varies, true});
    // Its exponent holds more than the shadow: the transmittance wants one of its own.
    if (shadowed && varies && keep_transmittance) {
      for_transmittance.push_back({index, true, false, false});
    }
  }
  lights.insert(lights.end(), for_transmittance.begin(), for_transmittance.end());
  return lights;
}

int TransmittanceSlot(const std::vector<TileLight>& lights, int light) {
  int slot = 0;
  for (size_t i = 0; i < lights.size(); ++i) {
    if (lights[i].light == light) slot = static_cast<int>(i);  // the last: without variation
  }
  return slot;
}

glm::vec3 ConstantLight(const Scene& scene) {
  glm::vec3 constant = scene.material.ambient;
  for (const Light& light : scene.lights) {
    if (!light.casts_shadows() && !RadianceVaries(light, scene.material)) constant += light.color;
  }
  return constant;
}

ShadedSprites Shading::View(const SpriteList& list) const {
  ShadedSprites view;
  view.sprites = list.sprites.data() + run.begin;
  view.rows = rows.data();
  view.unshadowed = unshadowed.data();
  view.depth = depth.empty() ? nullptr : depth.data();
  view.lights = lights;
  view.exponents = exponents;
  view.shadow_alone = shadow_alone.data();
  view.degree = degree;
  view.lit = lit.data();
  view.exponent = exponent.data();
  view.near = list.near.empty() ? nullptr : list.near.data() + run.begin;
  view.near_lights = near_lights.data();
  return view;
}

double NearDepth(const Scene& scene) {
  constexpr double kWide = 8.0;
  constexpr double kSteep = 2.0;  // nearer, the linear form is ill-conditioned
  const bool varies =
      std::any_of(scene.lights.begin(), scene.lights.end(),
                  [&](const Light& light) { return RadianceVaries(light, scene.material); });
  return varies ? kSteep : kWide;
}

Shading ShadeSprites(const Scene& scene, const ParticleView& particles, const Projection& eye,
                     const SpriteList& list, const TileRun& run,
                     const std::vector<TileLight>& tile_lights,
                     const std::vector<const LightFit*>& fits, int degree, bool keep_depth) {
  const Material& material = scene.material;
  const ParticleSet& set = particles.set();
  const size_t count = run.size();
  Shading shading;
  shading.run = run;
  shading.lights = static_cast<int>(tile_lights.size());
  shading.degree = degree;
  const glm::vec3 constant = ConstantLight(scene);
  std::vector<const LightFit*> fit_of;  // by slot
  std::vector<RadianceFactor> factors;
  std::vector<std::optional<LightAxesOf>> axes_of;
  for (const TileLight& light : tile_lights) {
    const Light& source = scene.lights[static_cast<size_t>(light.light)];
    const LightFit* const fit = fits[static_cast<size_t>(light.light)];
    fit_of.push_back(fit);
    shading.exponents = source.colored_density() && fit != nullptr ? 3 : shading.exponents;
    shading.shadow_alone[factors.size()] = !light.varies;
    factors.emplace_back(source, material, eye.view_from_world);
    axes_of.emplace_back();
    if (fit != nullptr) axes_of.back().emplace(fit->projection, eye, particles);
  }

  const size_t lights = tile_lights.size();
  const auto terms = static_cast<size_t>(Terms(degree));
  const auto exponents = static_cast<size_t>(shading.exponents);
  shading.rows.resize(2 * count);
  shading.unshadowed.resize(count);
  if (keep_depth) shading.depth.resize(3 * count);
  shading.lit.resize(count * lights);
  shading.exponent.resize(count * lights * exponents * terms);
  if (!list.near.empty()) shading.near_lights.resize(count * lights);
  ParallelRanges(count, [&](const WorkRange& range) {
    for (size_t place = range.begin; place < range.end; ++place) {
      const Rect& rect = list.rects[run.begin + place];
      if (rect.empty()) continue;
      const uint32_t i = list.particles[run.begin + place];
      const Sprite& sprite = list.sprites[run.begin + place];
      const bool near = !eye.orthographic && sprite.scale == 0.0F;
      shading.rows[2 * place] = rect.y_begin;
      shading.rows[2 * place + 1] = rect.y_end;
      const glm::vec3 albedo =
          set.colors.empty() ? material.albedo : material.albedo * set.colors[i];
      shading.unshadowed[place] =
          ToRgb(albedo * constant + (set.emissions.empty() ? material.emission : set.emissions[i]));

      const double radius = particles.radius(i);
      const Footprint footprint = FootprintOf(sprite, eye.orthographic);
      glm::dvec3 center(sprite.x, sprite.y, -1.0);  // view axes, from the eye
      if (near) {
        const float* const c = list.near[run.begin + place].center;
        center = radius * glm::dvec3(c[0], c[1], c[2]);
      } else if (!eye.orthographic) {
        center *= sprite.scale * radius;
      } else {
        const glm::dvec3 view = glm::dmat3(eye.view_from_world) *
                                (glm::dvec3(particles.positions()[i]) + (set.origin - eye.eye()));
        center = view;
      }
      if (keep_depth) {
        float* const depth = &shading.depth[3 * place];
        depth[0] = static_cast<float>(-center.z);
        depth[1] = static_cast<float>(near ? radius : -radius * footprint.y.z);
        depth[2] = static_cast<float>(near ? 0.0 : -radius * footprint.x.z);
      }

      for (size_t l = 0; l < lights; ++l) {
        const TileLight& light = tile_lights[l];
        const Light& source = scene.lights[static_cast<size_t>(light.light)];
        double factor = 1.0;
        Coefficients varying = {};
        if (light.varies) {
          const auto ray_at = [&](double x, double y) {
            if (eye.orthographic) return glm::dvec3(0.0, 0.0, -1.0);
            if (near) return glm::normalize(center);
            return glm::dvec3(sprite.x + x / sprite.scale, sprite.y + y / sprite.scale, -1.0);
          };
          const auto value = [&](double x, double y) {
            return factors[l](center + radius * (x * footprint.x + y * footprint.y), ray_at(x, y));
          };
          factor = value(0.0, 0.0);
          if (!near) varying = FitExponent(value, factor, degree);
        }
        shading.lit[place * lights + l] =
            light.adds ? ToRgb(albedo * source.color * static_cast<float>(factor)) : Rgb{};

        float* const own = &shading.exponent[(place * lights + l) * exponents * terms];
        const LightAxes axes = axes_of[l] ? (*axes_of[l])(i) : LightAxes{};
        for (size_t e = 0; e < exponents; ++e) {
          const std::span<float> out(own + e * terms, terms);
          if (fit_of[l] != nullptr) {
            const std::span<const float> depth(fit_of[l]->DepthOf(i, e), terms);
            const double density = source.shadow_density[static_cast<glm::length_t>(e)];
            if (near) {
              for (size_t t = 0; t < terms; ++t) out[t] = static_cast<float>(density * depth[t]);
              const auto narrow = [](const glm::dvec3& v, float* to) {
                for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(v[k]);
              };
              narrow(axes.x, shading.near_lights[place * lights + l].x);
              narrow(axes.y, shading.near_lights[place * lights + l].y);
            } else {
              Substitute(
                  degree, depth, {glm::dot(axes.x, footprint.x), glm::dot(axes.y, footprint.x)},
                  {glm::dot(axes.x, footprint.y), glm::dot(axes.y, footprint.y)}, density, out);
            }
          } else {
            std::fill(out.begin(), out.end(), 0.0F);
          }
          for (size_t t = 0; t < terms; ++t) out[t] += varying[t];
        }
      }
    }
  });
  return shading;
}

}  // namespace halflight::sweep
