#include "server/convert/convert_camera.h"

#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "server/convert/geometry.h"

namespace halflight {
namespace {

constexpr double kDefaultFovDeg = 40.0;
// Below this, pixels a unit overflow 32-bit floats sooner or later, and nothing is that far away.
constexpr double kSmallestFovDeg = 1e-6;
constexpr uint32_t kDefaultWidth = 640;
constexpr uint32_t kDefaultHeight = 480;

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

glm::dmat4 ConvertLookAt(const v1::LookAt& look_at, FieldChecks& checks) {
  const std::string path = "scene.camera.look_at";
  if (!look_at.has_eye()) {
    checks.Reject(path + ".eye", "unset", "a point");
  }
  if (!look_at.has_target()) {
    checks.Reject(path + ".target", "unset", "a point");
  }
  const glm::dvec3 eye = ConvertVector(look_at.eye(), path + ".eye", kPlace, checks);
  const glm::dvec3 target = ConvertVector(look_at.target(), path + ".target", kPlace, checks);
  const glm::dvec3 up = look_at.has_up() ? ConvertDirection(look_at.up(), path + ".up", checks)
                                         : glm::dvec3(0.0, 1.0, 0.0);
  const std::optional<glm::dvec3> forward = Direction(target - eye);
  if (!forward.has_value()) {
    checks.Reject(path + ".target", fmt::format("({}, {}, {})", target.x, target.y, target.z),
                  "a point that differs from eye by a finite distance");
    return glm::dmat4(1.0);
  }
  return LookAlong(eye, *forward, up);
}

glm::dmat4 ConvertWorldToCamera(const v1::Matrix4& matrix, FieldChecks& checks) {
  const std::string path = "scene.camera.world_to_camera";
  if (matrix.elements_size() != 16) {
    checks.Reject(path + ".elements", fmt::format("{} numbers", matrix.elements_size()),
                  "16 numbers");
    return glm::dmat4(1.0);
  }
  glm::dmat4 converted;
  for (int i = 0; i < 16; ++i) {
    const std::string element = fmt::format("{}.elements[{}]", path, i);
    const bool translates = i % 4 == 3 && i < 12;
    converted[i % 4][i / 4] =
        checks.InRange(element, matrix.elements(i), translates ? kPlace : kFinite);
  }
  if (!IsRigid(converted)) {
    checks.Reject(path, "a matrix that scales, shears, mirrors or projects",
                  "a rotation and a translation");
  }
  return converted;
}

std::variant<Perspective, Orthographic> ConvertProjection(const v1::Camera& camera,
                                                          FieldChecks& checks) {
  if (camera.has_orthographic()) {
    return Orthographic{checks.InRange("scene.camera.orthographic.height",
                                       camera.orthographic().height(),
                                       {.low = kSmallestRadius, .high = kPlace.high})};
  }
  double degrees = camera.perspective().vertical_fov_deg();
  if (degrees == 0.0) {
    degrees = kDefaultFovDeg;
  }
  checks.InRange("scene.camera.perspective.vertical_fov_deg", degrees,
                 {.low = kSmallestFovDeg, .high = 179.0, .open_high = true});
  return Perspective{degrees * kRadiansPerDegree};
}

// One axis of the crop window: its extent must be inside the image and not empty.
void CheckCrop(const std::string& field, uint64_t start, uint64_t extent, uint64_t whole,
               FieldChecks& checks) {
  if (extent == 0 || start + extent > whole) {
    checks.Reject(field, fmt::format("pixels [{}, {})", start, start + extent),
                  fmt::format("not empty and within [0, {})", whole));
  }
}

PixelRect ConvertWindow(const v1::Camera& camera, uint32_t width, uint32_t height,
                        FieldChecks& checks) {
  if (!camera.has_crop()) {
    return {0, 0, static_cast<int>(width), static_cast<int>(height)};
  }
  const v1::CropWindow& crop = camera.crop();
  CheckCrop("scene.camera.crop.width", crop.x(), crop.width(), width, checks);
  CheckCrop("scene.camera.crop.height", crop.y(), crop.height(), height, checks);
  return {static_cast<int>(crop.x()), static_cast<int>(crop.y()), static_cast<int>(crop.width()),
          static_cast<int>(crop.height())};
}

}  // namespace

glm::dvec3 ConvertVector(const v1::Vector3& vector, const std::string& field,
                         const Interval& allowed, FieldChecks& checks) {
  return {checks.InRange(field + ".x", vector.x(), allowed),
          checks.InRange(field + ".y", vector.y(), allowed),
          checks.InRange(field + ".z", vector.z(), allowed)};
}

glm::dvec3 ConvertDirection(const v1::Vector3& vector, const std::string& field,
                            FieldChecks& checks) {
  const std::optional<glm::dvec3> direction =
      Direction(ConvertVector(vector, field, kFinite, checks));
  if (!direction.has_value()) {
    checks.Reject(field, "(0, 0, 0)", "a direction of any length but zero");
  }
  return direction.value_or(glm::dvec3(0.0, 0.0, 1.0));
}

Camera ConvertCamera(const v1::Camera& camera, int supersample, const ServerLimits& limits,
                     FieldChecks& checks) {
  Camera converted;
  if (camera.has_look_at()) {
    converted.view_from_world = ConvertLookAt(camera.look_at(), checks);
  } else if (camera.has_world_to_camera()) {
    converted.view_from_world = ConvertWorldToCamera(camera.world_to_camera(), checks);
  } else {
    checks.Reject("scene.camera.view", "unset", "look_at or world_to_camera");
  }
  converted.projection = ConvertProjection(camera, checks);

  const Interval sizes{
      .low = 1.0, .high = static_cast<double>(limits.max_image_size), .server_limit = true};
  // What stands for one that is unset is not allowed everywhere either.
  const uint32_t width = checks.InRange(
      "scene.camera.width", camera.width() == 0 ? kDefaultWidth : camera.width(), sizes);
  const uint32_t height = checks.InRange(
      "scene.camera.height", camera.height() == 0 ? kDefaultHeight : camera.height(), sizes);
  converted.width = static_cast<int>(width);
  converted.height = static_cast<int>(height);
  converted.window = ConvertWindow(camera, width, height, checks);

  // Only the window is rendered, so only its samples are held.
  const double samples = std::max(converted.window.width, converted.window.height);
  if (samples * supersample > limits.max_image_size) {
    checks.Reject("scene.sampling.supersample",
                  fmt::format("{} with a window of {} x {} pixels", supersample,
                              converted.window.width, converted.window.height),
                  fmt::format("at most {} samples along each side", limits.max_image_size),
                  /*server_limit=*/true);
  }
  return converted;
}

}  // namespace halflight
