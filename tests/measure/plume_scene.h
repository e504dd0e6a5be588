// The smoke plume as measurements see it: one radius, one camera, one light.
// Leaves out how it is drawn: ShadowSettings and Sampling are those of an empty Scene.
#pragma once

#include <memory>
#include <string>

#include <glm/vec3.hpp>

#include "absl/status/statusor.h"
#include "renderer/scene.h"
#include "tests/measure/replicate.h"

namespace halflight::measure {

// What tests/data/plume/README.md says looks right.
inline constexpr float kPlumeRadius = 0.045F;
inline constexpr float kPlumeOpacity = 0.18F;
// How far copies of a particle stand from it at most, where there are to be more.
inline constexpr float kPlumeJitter = 0.5F * kPlumeRadius;

// In which light travels that comes from the left, somewhat from above and from behind the camera.
inline constexpr glm::dvec3 kSideLight{1.0, -0.6, -0.6};

// Turned round the plume by so many degrees.
Camera PlumeCamera(int width, int height, double turn_degrees = 0.0);

// plume/plume.<frame>.ply in the folder; `frame` has four digits. NotFound, naming the file, where
// it cannot be read or has no particles.
absl::StatusOr<std::shared_ptr<const ParticleSet>> LoadPlumeFrame(const std::string& data_folder,
                                                                  const std::string& frame);

// `direction` is that in which the light travels, of any length.
Scene PlumeScene(const Replica& replica, const glm::dvec3& direction, int width, int height);

}  // namespace halflight::measure
