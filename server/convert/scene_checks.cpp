#include "server/convert/scene_checks.h"

#include <memory>
#include <optional>
#include <variant>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "renderer/target/features.h"
#include "server/convert/enums.h"
#include "server/convert/geometry.h"
#include "server/convert/particle_bounds.h"

namespace halflight {
namespace {

// One for all requests, so that a set is walked over once and not whenever it is named: requests
// are converted on threads that answer calls.
BoundsCache& Cache() {
  static BoundsCache cache;
  return cache;
}

std::shared_ptr<const ParticleBounds> KnownBounds(const std::shared_ptr<const ParticleSet>& set) {
  return Cache().Of(set);
}

bool IsAllowed(const glm::dvec3& offset) {
  return kOffset.Contains(offset.x) && kOffset.Contains(offset.y) && kOffset.Contains(offset.z);
}

// Positions as they are after the offset keep to the bounds of those that are sent.
void CheckMoved(const std::shared_ptr<const ParticleSet>& set, double time_offset_s,
                FieldChecks& checks) {
  const VectorRange reached = PositionsAfter(*KnownBounds(set), time_offset_s);
  if (IsAllowed(reached.low) && IsAllowed(reached.high)) {
    return;
  }
  const ParticleSet& particles = *set;
  for (size_t i = 0; i < particles.velocities.size() && checks.ok(); ++i) {
    const glm::dvec3 moved =
        glm::dvec3(particles.positions[i]) + time_offset_s * glm::dvec3(particles.velocities[i]);
    if (!IsAllowed(moved)) {
      checks.Reject("scene.time_offset_s",
                    fmt::format("{}, which moves particle {} to ({}, {}, {})", time_offset_s, i,
                                moved.x, moved.y, moved.z),
                    "positions in " + kOffset.ToString());
    }
  }
}

bool Moves(const Scene& scene) {
  return scene.time_offset_s != 0.0 && !scene.particles->velocities.empty();
}

// Bounds of the scene's particles.
std::optional<BoundingSphere> BoundsOf(const Scene& scene) {
  std::optional<BoundingSphere> sphere = Moves(scene)
                                             ? Cache().After(scene.particles, scene.time_offset_s)
                                             : KnownBounds(scene.particles)->at_rest;
  if (sphere.has_value() && scene.particles->radii.empty()) {
    sphere->radius += scene.material.radius;
  }
  return sphere;
}

// Whether the point is so far from particles that move that they need not be walked over: the
// middle of their bounding sphere is in the box, and its radius no more than half the diagonal and
// a particle's.
bool IsFarFrom(const Scene& scene, const glm::dvec3& point) {
  constexpr double kRounding = 1e-9;
  const ParticleSet& set = *scene.particles;
  const auto bounds = KnownBounds(scene.particles);
  const VectorRange box = PositionsAfter(*bounds, scene.time_offset_s);
  const glm::dvec3 offset = point - set.origin;
  const double distance =
      glm::length(glm::max(glm::dvec3(0.0), glm::max(box.low - offset, offset - box.high)));
  const double own = set.radii.empty() ? scene.material.radius : bounds->largest_radius;
  const double radius = 0.5 * glm::length(box.high - box.low) + own;
  return distance > radius + kRounding * (glm::length(point) + glm::length(set.origin) + radius);
}

// A light buffer shows the particles from the light through one frustum, so that a light among them
// would see only some.
void CheckPointLights(const Scene& scene, FieldChecks& checks) {
  std::optional<BoundingSphere> bounds;  // once a light has asked
  for (size_t i = 0; i < scene.lights.size(); ++i) {
    const auto* const point = std::get_if<PointLight>(&scene.lights[i].kind);
    if (point == nullptr || !scene.lights[i].casts_shadows() || scene.particles->size() == 0 ||
        (Moves(scene) && IsFarFrom(scene, point->position))) {
      continue;
    }
    if (!bounds.has_value()) {
      bounds = BoundsOf(scene);
    }
    const double distance = glm::length(point->position - bounds->center);
    if (!(distance > bounds->radius)) {
      checks.Reject(
          fmt::format("scene.lighting.lights[{}].point.position", i),
          fmt::format("{} from the centre of the particles", distance),
          fmt::format("more than {}, the radius of their bounding sphere, for a light "
                      "that casts shadows under {}",
                      bounds->radius,
                      v1::ShadowTechnique_Name(ToProto(kTechniques, scene.shadow.technique))));
    }
  }
}

}  // namespace

void CheckMotion(const Scene& scene, FieldChecks& checks) {
  if (scene.time_offset_s != 0.0 && scene.particles->velocities.empty() &&
      scene.particles->size() > 0) {
    checks.Reject("scene.time_offset_s", fmt::format("{}", scene.time_offset_s),
                  "0 or unset where the particle set has no VELOCITY");
  }
  if (checks.ok() && Moves(scene)) {
    CheckMoved(scene.particles, scene.time_offset_s, checks);
  }
}

void CheckTechnique(const Scene& scene, const ServerLimits& limits, FieldChecks& checks) {
  if (scene.shadow.technique != ShadowTechniqueKind::kReference) {
    CheckPointLights(scene, checks);
  } else {
    CheckReferenceWork("scene.shadow.technique", "SHADOW_TECHNIQUE_REFERENCE",
                       static_cast<double>(scene.camera.window.width) * scene.camera.window.height,
                       scene, limits, checks);
  }
}

void CheckReferenceWork(const std::string& field, const std::string& what, double pixels,
                        const Scene& scene, const ServerLimits& limits, FieldChecks& checks) {
  const double work = ReferenceWork(scene, pixels);
  if (work > static_cast<double>(limits.max_reference_work)) {
    const auto particles = static_cast<double>(scene.particles->size());
    checks.Reject(
        field,
        fmt::format("{} of {} samples times {} particles", what, work / particles, particles),
        fmt::format("a product of at most {}", limits.max_reference_work), /*server_limit=*/true);
  }
}

}  // namespace halflight
