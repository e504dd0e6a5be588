#include "tests/hard_cases/random_scene.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <sstream>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>
#include "tests/hard_cases/same_picture.h"

namespace halflight::fuzz {
namespace {

// The cloud fits a ball of this radius, in units of the scene's scale, particles and motion
// included; lights that must stand outside do so well beyond it.
constexpr double kCloudRadius = 1.8;
// Of the cloud's extent: places in an order that are this near count as tied.
constexpr double kTie = 1e-5;

glm::vec3 DrawColor(Dice& dice, double brightest) {
  if (dice.Chance(0.1)) return glm::vec3(0.0F);
  return {dice.Between(0.0, brightest), dice.Between(0.0, brightest), dice.Between(0.0, brightest)};
}

std::shared_ptr<ParticleSet> DrawParticles(Dice& dice) {
  auto set = std::make_shared<ParticleSet>();
  const int count = static_cast<int>(std::pow(300.0, dice.Unit()) + 0.5);
  const bool radii = dice.Chance(0.6);
  const bool opacities = dice.Chance(0.6);
  const bool colors = dice.Chance(0.5);
  const bool emissions = dice.Chance(0.3);
  const bool velocities = dice.Chance(0.3);
  const double largest_opacity = dice.Chance(0.2) ? 1.0 : dice.Between(0.05, 0.9);
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 place = dice.Direction() * std::cbrt(dice.Unit());
    set->positions.emplace_back(place);
    if (radii) set->radii.push_back(static_cast<float>(dice.Between(0.1, 0.45)));
    if (opacities) {
      set->opacities.push_back(
          dice.Chance(0.05) ? 0.0F : static_cast<float>(largest_opacity * dice.Unit()));
    }
    if (colors) set->colors.push_back(DrawColor(dice, 2.0));
    if (emissions) set->emissions.push_back(DrawColor(dice, 0.5));
    if (velocities) set->velocities.emplace_back(dice.Vector(-0.15, 0.15));
  }
  return set;
}

Light DrawLight(Dice& dice, const glm::dvec3& view, bool may_stand_inside) {
  Light light;
  const double kind = dice.Unit();
  if (kind < 0.5) {
    light.kind = DirectionalLight{dice.Direction()};
  } else if (kind < 0.6) {
    light.kind = DirectionalLight{dice.Chance(0.5) ? view : -view};
  } else {
    const double away = may_stand_inside && dice.Chance(0.4)
                            ? dice.Between(0.0, 1.0)
                            : kCloudRadius * dice.Between(1.3, 6.0);
    light.kind = PointLight{away * dice.Direction(), dice.Chance(0.4)};
  }
  light.color = dice.Chance(0.5) ? glm::vec3(1.0F) : DrawColor(dice, 4.0);
  const double density = dice.Unit();
  light.shadow_density = density < 0.2   ? glm::vec3(0.0F)
                         : density < 0.7 ? glm::vec3(static_cast<float>(dice.Between(0.2, 3.0)))
                                         : DrawColor(dice, 3.0);
  return light;
}

Camera DrawCamera(Dice& dice) {
  Camera camera;
  const bool inside = dice.Chance(0.15);
  const glm::dvec3 eye =
      dice.Direction() * (inside ? dice.Between(0.0, 1.0) : dice.Between(2.0, 6.0));
  const glm::dvec3 target = dice.Vector(-0.4, 0.4);
  camera.view_from_world = glm::lookAt(eye, target, dice.Direction());
  if (dice.Chance(0.25)) {
    camera.projection = Orthographic{dice.Between(1.0, 4.0)};
  } else {
    const double degrees = inside ? dice.Between(60.0, 150.0) : dice.Between(15.0, 80.0);
    camera.projection = Perspective{degrees * std::numbers::pi / 180.0};
  }
  camera.width = dice.Integer(9, 32);
  camera.height = dice.Integer(9, 32);
  camera.window = {0, 0, camera.width, camera.height};
  if (dice.Chance(0.4)) {
    camera.window.x = dice.Integer(0, camera.width / 3);
    camera.window.y = dice.Integer(0, camera.height / 3);
    camera.window.width = dice.Integer(3, camera.width - camera.window.x);
    camera.window.height = dice.Integer(3, camera.height - camera.window.y);
  }
  return camera;
}

Material DrawMaterial(Dice& dice) {
  Material material;
  material.profile = dice.Chance(0.5) ? Profile::kSoft : Profile::kBall;
  material.radius = static_cast<float>(dice.Between(0.1, 0.45));
  material.opacity = static_cast<float>(dice.Between(0.01, 0.7));
  if (dice.Chance(0.5)) material.albedo = DrawColor(dice, 1.5);
  if (dice.Chance(0.3)) material.emission = DrawColor(dice, 0.5);
  material.ambient = DrawColor(dice, 0.5);
  if (dice.Chance(0.4)) material.phase_g = static_cast<float>(dice.Between(-0.7, 0.7));
  return material;
}

ShadowSettings DrawShadow(Dice& dice) {
  ShadowSettings shadow;
  if (dice.Chance(0.25)) shadow.technique = ShadowTechniqueKind::kReference;
  shadow.slices = dice.Chance(0.2) ? 1000 : dice.Integer(1, 48);
  shadow.interpolate = dice.Chance(0.7);
  if (dice.Chance(0.3)) shadow.spacing = SliceSpacing::kEqualOpticalDepth;
  shadow.light_buffer_size = 64 * dice.Integer(4, 8);
  return shadow;
}

glm::dvec3 CenterOf(const Scene& scene, size_t i) {
  const ParticleSet& set = *scene.particles;
  glm::dvec3 center(set.positions[i]);
  if (!set.velocities.empty()) center += scene.time_offset_s * glm::dvec3(set.velocities[i]);
  return center;
}

glm::dvec3 ViewOf(const Scene& scene) {
  return -glm::dvec3(glm::row(scene.camera.view_from_world, 2));
}

// The particles' places in one order, each drawn in some frame of the scene.
using Order = std::vector<double>;

std::vector<Order> OrdersOf(const Scene& scene) {
  const size_t count = scene.particles->size();
  glm::dvec3 low(1e30);
  glm::dvec3 high(-1e30);
  for (size_t i = 0; i < count; ++i) {
    low = glm::min(low, CenterOf(scene, i));
    high = glm::max(high, CenterOf(scene, i));
  }
  const glm::dvec3 view = ViewOf(scene);
  const glm::dvec3 eye = -glm::transpose(glm::dmat3(scene.camera.view_from_world)) *
                         glm::dvec3(scene.camera.view_from_world[3]);
  const auto order_by = [&](const auto& key) {
    Order order;
    for (size_t i = 0; i < count; ++i) order.push_back(key(CenterOf(scene, i)));
    return order;
  };
  std::vector<Order> orders;
  orders.push_back(order_by([&](const glm::dvec3& p) { return glm::dot(p, view); }));
  orders.push_back(order_by([&](const glm::dvec3& p) { return glm::distance(p, eye); }));
  for (const Light& light : scene.lights) {
    const auto* point = std::get_if<PointLight>(&light.kind);
    const glm::dvec3 travel = point != nullptr
                                  ? glm::normalize((low + high) / 2.0 - point->position)
                                  : std::get<DirectionalLight>(light.kind).direction;
    const glm::dvec3 half =
        glm::normalize(glm::dot(view, travel) > 0.0 ? view + travel : travel - view);
    orders.push_back(order_by([&](const glm::dvec3& p) { return glm::dot(p, half); }));
    orders.push_back(order_by([&](const glm::dvec3& p) {
      return point != nullptr ? glm::distance(p, point->position) : glm::dot(p, travel);
    }));
  }
  return orders;
}

template <typename T>
void KeepOnly(const std::vector<size_t>& kept, std::vector<T>& values) {
  if (values.empty()) return;
  std::vector<T> left;
  for (const size_t i : kept) left.push_back(values[i]);
  values = std::move(left);
}

// Leaves out one of each two particles that are tied in some order; says whether there were any.
// What is left has other bounds, and with them other orders.
bool DropTies(Scene& scene) {
  const std::vector<Order> orders = OrdersOf(scene);
  const size_t count = scene.particles->size();
  std::vector<bool> dropped(count, false);
  for (const Order& order : orders) {
    std::vector<size_t> sorted(count);
    std::iota(sorted.begin(), sorted.end(), size_t{0});
    std::sort(sorted.begin(), sorted.end(),
              [&order](size_t a, size_t b) { return order[a] < order[b]; });
    for (size_t k = 1; k < count; ++k) {
      if (order[sorted[k]] - order[sorted[k - 1]] < kTie) dropped[sorted[k]] = true;
    }
  }
  std::vector<size_t> kept;
  for (size_t i = 0; i < count; ++i) {
    if (!dropped[i]) kept.push_back(i);
  }
  if (kept.size() == count) return false;
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  KeepOnly(kept, set->positions);
  KeepOnly(kept, set->radii);
  KeepOnly(kept, set->opacities);
  KeepOnly(kept, set->colors);
  KeepOnly(kept, set->velocities);
  KeepOnly(kept, set->emissions);
  scene.particles = set;
  return true;
}

}  // namespace

glm::dvec3 Dice::Vector(double low, double high) {
  const double x = Between(low, high);
  const double y = Between(low, high);
  return {x, y, Between(low, high)};
}

glm::dvec3 Dice::Direction() {
  const double z = Between(-1.0, 1.0);
  const double angle = Between(0.0, 2.0 * std::numbers::pi);
  const double across = std::sqrt(1.0 - z * z);
  return {across * std::cos(angle), across * std::sin(angle), z};
}

Scene DrawScene(Dice& dice) {
  Scene scene;
  scene.particles = DrawParticles(dice);
  if (!scene.particles->velocities.empty()) scene.time_offset_s = dice.Between(-1.0, 1.0);
  scene.camera = DrawCamera(dice);
  scene.material = DrawMaterial(dice);
  scene.shadow = DrawShadow(dice);
  const bool reference = scene.shadow.technique == ShadowTechniqueKind::kReference;
  for (int lights = dice.Integer(0, 3); lights > 0; --lights) {
    scene.lights.push_back(DrawLight(dice, ViewOf(scene), reference));
  }
  const double sampling = dice.Unit();
  if (sampling < 0.25) scene.sampling.supersample = dice.Integer(2, 3);
  // The reference samples every pixel.
  if (!reference && sampling > 0.85) scene.sampling.downsample = dice.Integer(2, 3);
  // Slices of equal weight end where sums of weights are equal, which rounding decides.
  if (scene.particles->radii.empty()) scene.shadow.spacing = SliceSpacing::kEqualCount;
  while (DropTies(scene)) {
  }
  if (dice.Chance(0.4)) {
    const double scale = std::pow(10.0, dice.Between(-6.0, 6.0));
    scene = test::Moved(test::Scaled(scene, scale), scale * dice.Vector(-1e7, 1e7));
  }
  return scene;
}

std::string Describe(const Scene& scene) {
  const ParticleSet& set = *scene.particles;
  std::ostringstream text;
  const auto has = [&text](const char* name, bool present) {
    if (present) text << " " << name;
  };
  text << set.size() << " particles with";
  has("radii", !set.radii.empty());
  has("opacities", !set.opacities.empty());
  has("colors", !set.colors.empty());
  has("emissions", !set.emissions.empty());
  has("velocities", !set.velocities.empty());
  text << " of their own, origin (" << set.origin.x << ", " << set.origin.y << ", " << set.origin.z
       << "); profile " << (scene.material.profile == Profile::kBall ? "BALL" : "SOFT")
       << ", phase_g " << scene.material.phase_g << "\n  camera "
       << (std::holds_alternative<Perspective>(scene.camera.projection) ? "perspective "
                                                                        : "orthographic ")
       << scene.camera.width << " x " << scene.camera.height << ", window " << scene.camera.window.x
       << " " << scene.camera.window.y << " " << scene.camera.window.width << " "
       << scene.camera.window.height << ", supersample " << scene.sampling.supersample
       << ", downsample " << scene.sampling.downsample << "\n  technique "
       << (scene.shadow.technique == ShadowTechniqueKind::kReference ? "REFERENCE" : "HALF_ANGLE")
       << ", slices " << scene.shadow.slices << (scene.shadow.interpolate ? " interpolated" : "")
       << (scene.shadow.spacing == SliceSpacing::kEqualCount ? "" : " of equal optical depth")
       << ", light buffer " << scene.shadow.light_buffer_size;
  for (const Light& light : scene.lights) {
    const auto* point = std::get_if<PointLight>(&light.kind);
    const glm::dvec3 where =
        point != nullptr ? point->position : std::get<DirectionalLight>(light.kind).direction;
    text << "\n  " << (point != nullptr ? "point" : "directional") << " light (" << where.x << ", "
         << where.y << ", " << where.z << ")"
         << (point != nullptr && point->inverse_square_falloff ? " with falloff" : "")
         << ", color (" << light.color.x << ", " << light.color.y << ", " << light.color.z
         << "), density (" << light.shadow_density.x << ", " << light.shadow_density.y << ", "
         << light.shadow_density.z << ")";
  }
  return text.str();
}

}  // namespace halflight::fuzz
