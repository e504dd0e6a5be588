// Projections onto a target's pixels, the eye's and the lights', built in float64 and rebased to
// the particle set. See ProjectionBlock in shaders/bindings.h for "plane" and pixel coordinates.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "renderer/particle_view.h"
#include "renderer/scene.h"
#include "shaders/bindings.h"

namespace halflight {

struct Projection {
  glm::dmat4 view_from_world{1.0};  // rigid; x right, y up, looking along -z
  bool orthographic = false;
  glm::ivec2 size{1};                // target, pixels
  glm::dvec2 pixel_from_plane{1};    // scale
  glm::dvec2 pixel_offset{0};        // pixel = plane * pixel_from_plane + pixel_offset
  bool near_eye = false;             // particles may reach the plane through the eye
  double least_radius = 0.0;         // plane units; smaller particles are drawn as large as this
  double optical_depth_scale = 1.0;  // of all particles

  bool operator==(const Projection&) const = default;

  // Maps world points to target coordinates: after division by w, (0, 0) is the outer corner of the
  // top left pixel and (1, 1) that of the bottom right one.
  [[nodiscard]] glm::dmat4 texture_from_world() const;
  // Position of the eye (or light) in the world.
  [[nodiscard]] glm::dvec3 eye() const;
  // The uniform block, for these particles.
  [[nodiscard]] shader::ProjectionBlock block(const ParticleView& particles) const;
};

// The eye's projection onto a target that samples the camera's window with `samples` samples a
// pixel along each side (below 1: fewer samples than pixels).
Projection EyeProjection(const Camera& camera, const glm::ivec2& target_size, double samples);

// The same onto all samples of a scene's image.
Projection EyeProjection(const Scene& scene, const glm::ivec2& composite_size);

// Along which the camera looks, in the world. Unit length.
glm::dvec3 ViewDirection(const Camera& camera);

// Slopes of the two tangents from the origin to a circle of radius r around (x, w), w > r.
glm::dvec2 TangentSlopes(double x, double w, double r);

// Whether any particle reaches the plane through the projection's eye, or comes so near to it that
// rounding may tell otherwise.
bool ReachesEyePlane(const Projection& projection, const ParticleView& particles);

// A projection from a light onto a square light buffer, fitted to the particles: shows all of each
// of them and leaves only the border that filtering needs. `spread` widens the border by that many
// world units for light that scatters sideways. A point light must not lie among the particles.
Projection LightProjection(const Light& light, const ParticleView& particles, int size,
                           double spread);

// Whether some particle reaches the plane through a point light, across the direction in which its
// light travels at the particles: then no one frustum shows them all. Never so for other lights.
bool LiesAmong(const Light& light, const ParticleView& particles);

// The direction in which light travels at the particles: towards the centre of their bounds for a
// point light; downward, should it stand right there. Unit length.
glm::dvec3 TravelDirection(const Light& light, const ParticleView& particles);

}  // namespace halflight
