// The mathematics of conversion, in float64: directions, rigid motions, projections to the image.
// Knows nothing of messages.
#pragma once

#include <optional>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "renderer/scene.h"

namespace halflight {

// Unit vector along v, of any finite length; none for zero.
std::optional<glm::dvec3> Direction(const glm::dvec3& v);

// Camera space of an eye looking along the unit vector `forward`. Where `up` is parallel to it, the
// coordinate axis farthest from it takes its place. Both are unit vectors.
glm::dmat4 LookAlong(const glm::dvec3& eye, const glm::dvec3& forward, const glm::dvec3& up);

// Whether the matrix is a rotation and a translation, within what matrices that went through
// float32 are off.
bool IsRigid(const glm::dmat4& matrix);

// World to the whole image: after division by w, (0, 0) is its top left corner and (1, 1) the
// bottom right one; z is 1 / distance along the view for a perspective, the distance otherwise.
glm::dmat4 NdcFromWorld(const Camera& camera);

struct BoundingSphere {
  glm::dvec3 center;
  double radius;
};

// A sphere round all particles as they are drawn, radii and motion included; none for an empty set.
// Its centre is that of the centres' bounding box.
std::optional<BoundingSphere> Bounds(const ParticleSet& set, float material_radius,
                                     double time_offset_s);

}  // namespace halflight
