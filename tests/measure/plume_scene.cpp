#include "tests/measure/plume_scene.h"

#define GLM_ENABLE_EXPERIMENTAL
#include <glm/gtx/rotate_vector.hpp>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "tests/oracle/plume.h"
#include "tests/renderer/test_scene.h"

namespace halflight::measure {

Camera PlumeCamera(int width, int height, double turn_degrees) {
  const glm::dvec3 target(0.0, 1.25, 0.0);
  const glm::dvec3 eye(0.5, 1.5, 4.6);
  return test::LookAt(target + glm::rotateY(eye - target, turn_degrees * test::kDegree), target,
                      width, height);
}

absl::StatusOr<std::shared_ptr<const ParticleSet>> LoadPlumeFrame(const std::string& data_folder,
                                                                  const std::string& frame) {
  const std::string path = absl::StrCat(data_folder, "/plume/plume.", frame, ".ply");
  std::shared_ptr<ParticleSet> set = oracle::LoadPlume(path);
  if (set == nullptr || set->positions.empty()) {
    return absl::NotFoundError(absl::StrCat("data: cannot read the plume in ", path));
  }
  return set;
}

Scene PlumeScene(const Replica& replica, const glm::dvec3& direction, int width, int height) {
  Scene scene;
  scene.particles = replica.particles;
  scene.camera = PlumeCamera(width, height);
  scene.lights = {test::Sun(direction)};
  scene.material.radius = kPlumeRadius;
  scene.material.opacity = replica.opacity;
  return scene;
}

}  // namespace halflight::measure
