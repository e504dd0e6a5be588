// Camera messages to the renderer's camera, with every check of their values. Leaves the rest of
// the scene to convert_scene.
#pragma once

#include <string>

#include <glm/vec3.hpp>

#include "halflight/v1/scene.pb.h"
#include "renderer/scene.h"
#include "server/convert/field_checks.h"
#include "server/limits.h"

namespace halflight {

// Of eyes, their targets and lights: from farther away than particles may be, but not so far that
// 32-bit floats have no square of the distance.
inline constexpr Interval kPlace{.low = -10.0 * kLargestLength, .high = 10.0 * kLargestLength};

// A vector with components in `allowed`.
glm::dvec3 ConvertVector(const v1::Vector3& vector, const std::string& field,
                         const Interval& allowed, FieldChecks& checks);

// A unit vector along a finite vector of any length but zero.
glm::dvec3 ConvertDirection(const v1::Vector3& vector, const std::string& field,
                            FieldChecks& checks);

// `supersample` counts towards the limit on image sizes. The result is only meaningful when the
// checks are passed; field paths start with "scene.camera".
Camera ConvertCamera(const v1::Camera& camera, int supersample, const ServerLimits& limits,
                     FieldChecks& checks);

}  // namespace halflight
