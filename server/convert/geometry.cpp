#include "server/convert/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace halflight {
namespace {

// Sine of the angle below which two directions count as parallel: well above rounding, far below
// what anybody means by a tilted camera.
constexpr double kParallel = 1e-6;

// Per element of the product with the transpose; float32 matrices are off by about 1e-7.
constexpr double kRigidTolerance = 1e-5;

glm::dvec3 AxisFarthestFrom(const glm::dvec3& direction) {
  const glm::dvec3 size = glm::abs(direction);
  if (size.x <= size.y && size.x <= size.z) {
    return {1.0, 0.0, 0.0};
  }
  return size.z <= size.y ? glm::dvec3{0.0, 0.0, 1.0} : glm::dvec3{0.0, 1.0, 0.0};
}

glm::dmat4 ImageFromView(const Camera& camera) {
  const double aspect = static_cast<double>(camera.width) / camera.height;
  glm::dmat4 m(0.0);
  const auto row = [&m](int r, double x, double y, double z, double w) {
    m[0][r] = x;
    m[1][r] = y;
    m[2][r] = z;
    m[3][r] = w;
  };
  if (const auto* perspective = std::get_if<Perspective>(&camera.projection)) {
    const double half_height = std::tan(0.5 * perspective->vertical_fov);
    row(0, 0.5 / (half_height * aspect), 0.0, -0.5, 0.0);
    row(1, 0.0, -0.5 / half_height, -0.5, 0.0);
    row(2, 0.0, 0.0, 0.0, 1.0);
    row(3, 0.0, 0.0, -1.0, 0.0);
    return m;
  }
  const double height = std::get<Orthographic>(camera.projection).height;
  row(0, 1.0 / (height * aspect), 0.0, 0.0, 0.5);
  row(1, 0.0, -1.0 / height, 0.0, 0.5);
  row(2, 0.0, 0.0, -1.0, 0.0);
  row(3, 0.0, 0.0, 0.0, 1.0);
  return m;
}

}  // namespace

std::optional<glm::dvec3> Direction(const glm::dvec3& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0.0) || !std::isfinite(largest)) {
    return std::nullopt;
  }
  // Scaled first, so that the squares neither overflow nor vanish.
  return glm::normalize(v / largest);
}

glm::dmat4 LookAlong(const glm::dvec3& eye, const glm::dvec3& forward, const glm::dvec3& up) {
  glm::dvec3 side = glm::cross(forward, up);
  if (glm::length(side) < kParallel) {
    side = glm::cross(forward, AxisFarthestFrom(forward));
  }
  const glm::dvec3 right = glm::normalize(side);
  const glm::dvec3 above = glm::cross(right, forward);
  const glm::dmat3 view_from_world = glm::transpose(glm::dmat3(right, above, -forward));
  glm::dmat4 m(view_from_world);
  m[3] = glm::dvec4(-(view_from_world * eye), 1.0);
  return m;
}

bool IsRigid(const glm::dmat4& matrix) {
  if (matrix[0][3] != 0.0 || matrix[1][3] != 0.0 || matrix[2][3] != 0.0 || matrix[3][3] != 1.0) {
    return false;
  }
  const glm::dmat3 rotation(matrix);
  const glm::dmat3 product = glm::transpose(rotation) * rotation;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (!(std::abs(product[i][j] - (i == j ? 1.0 : 0.0)) <= kRigidTolerance)) {
        return false;
      }
    }
  }
  return glm::determinant(rotation) > 0.0;
}

glm::dmat4 NdcFromWorld(const Camera& camera) {
  return ImageFromView(camera) * camera.view_from_world;
}

std::optional<BoundingSphere> Bounds(const ParticleSet& set, float material_radius,
                                     double time_offset_s) {
  if (set.size() == 0) {
    return std::nullopt;
  }
  const auto center_of = [&](size_t i) {
    glm::dvec3 center = set.positions[i];
    if (!set.velocities.empty()) {
      center += time_offset_s * glm::dvec3(set.velocities[i]);
    }
    return center;
  };
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high = -low;
  for (size_t i = 0; i < set.size(); ++i) {
    low = glm::min(low, center_of(i));
    high = glm::max(high, center_of(i));
  }
  const glm::dvec3 middle = 0.5 * (low + high);
  double radius = 0.0;
  for (size_t i = 0; i < set.size(); ++i) {
    const double own = set.radii.empty() ? material_radius : set.radii[i];
    radius = std::max(radius, glm::length(center_of(i) - middle) + own);
  }
  return BoundingSphere{set.origin + middle, radius};
}

}  // namespace halflight
