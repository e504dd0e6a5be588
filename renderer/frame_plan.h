// The list of passes a frame needs, computed from the request alone: no GL, no particle data.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "absl/status/statusor.h"
#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight {

struct FrameRequest;

// One walk over all particles in one order, which adds the light of some lights to the image.
struct Traversal {
  // The light whose shadows this walk computes, if any.
  std::optional<int> shadow_light;
  // Lights that need no shadows, and with them ambient light and emission: in one walk only.
  std::vector<int> unshadowed_lights;
  bool ambient_and_emission = false;

  // Unit vector along which particles are sorted, ascending; none: by distance from the eye.
  std::optional<glm::dvec3> axis;
  bool back_to_front = false;
  int slices = 1;
  bool interpolate = false;
  SliceSpacing spacing = SliceSpacing::kEqualCount;

  int light_buffer_size = 0;    // texels along each side; 0: no light buffer
  int light_channels = 1;       // 3 only where blur treats the colours differently
  bool blur = false;
  bool keep_layers = false;     // read the light buffer back after every slice
};

struct PlannedPass {
  std::string name;
  std::string reason;
  int count = 1;
};

struct FramePlan {
  glm::ivec2 window_size{0};     // pixels of the image
  glm::ivec2 composite_size{0};  // pixels composited, after super- or downsampling
  bool depth_target = false;
  std::optional<int> transmittance_light;  // the light whose transmittance target is needed
  std::vector<Traversal> traversals;
  std::vector<PlannedPass> passes;  // what the above comes to, for people
};

// Fails with InvalidArgument, naming the field, where the scene asks for what its technique
// cannot do.
absl::StatusOr<FramePlan> PlanFrame(const FrameRequest& request);

}  // namespace halflight
