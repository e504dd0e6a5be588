// The list of passes a frame needs, computed on the CPU from the request: no GL.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "absl/status/statusor.h"
#include "renderer/image.h"
#include "renderer/particle_view.h"
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
  bool in_tiles = false;  // composited in compute, not through the blend units
  SliceSpacing spacing = SliceSpacing::kEqualCount;

  int light_buffer_size = 0;          // texels along each side; 0: no light buffer
  bool colored_light_buffer = false;  // three channels: only where blur treats them differently
  bool blur = false;
  bool keep_unscattered = false;  // of the light, only what is scattered spreads
  // What outputs show of this light: its transmittance at the particles that the eye sees, the
  // light buffer behind the last slice, the light buffer after every slice.
  bool keep_transmittance = false;
  bool keep_light_buffer = false;
  bool keep_layers = false;
};

struct PlannedPass {
  std::string name;
  std::string reason;
  int count = 1;  // 0: not run, an earlier frame left what it gives

  bool operator==(const PlannedPass&) const = default;
};

struct FramePlan {
  glm::ivec2 window_size{0};     // pixels of the image
  glm::ivec2 composite_size{0};  // pixels composited, after super- or downsampling
  int light_buffer_size = 0;     // texels along each side of all light buffers, if any
  bool keep_depth = false;       // an output shows it; drawn by the first traversal
  // Of slicing at least one; of the light sweep and the particle shadow map one for each light that
  // casts shadows; of the reference none.
  std::vector<Traversal> traversals;
  std::vector<PlannedPass> passes;  // what the above comes to, for people
};

// Samples composited for a window of the image.
glm::ivec2 CompositeSize(const PixelRect& window, const Sampling& sampling);

// What the walk of a light that casts shadows is before its technique gives it an axis: slices, of
// which there are no more than particles, and a light buffer.
Traversal PlanLightBuffer(const Scene& scene, const ParticleView& particles, int light);

// `particles` is the view of request.scene. Fails with InvalidArgument, naming the field, where the
// scene asks for what its technique cannot do.
absl::StatusOr<FramePlan> PlanFrame(const FrameRequest& request, const ParticleView& particles);

}  // namespace halflight
