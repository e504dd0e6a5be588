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

// A finite vector.
glm::dvec3 ConvertVector(const v1::Vector3& vector, const std::string& field, FieldChecks& checks);

// A unit vector along a finite vector of any length but zero.
glm::dvec3 ConvertDirection(const v1::Vector3& vector, const std::string& field,
                            FieldChecks& checks);

// `supersample` counts towards the limit on image sizes. The result is only meaningful when the
// checks are passed; field paths start with "scene.camera".
Camera ConvertCamera(const v1::Camera& camera, int supersample, const ServerLimits& limits,
                     FieldChecks& checks);

}  // namespace halflight
