// A frame's way through the renderer: what is asked, and what comes back.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "renderer/frame_plan.h"
#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight {

// Where frames of the light sweep are drawn.
enum class SweepOn : uint8_t {
  kAuto,  // on the device, unless it is a CPU in disguise or cannot hold the frame
  kCpu,
  kDevice,
};

struct FrameRequest {
  Scene scene;
  std::vector<ImageRequest> images;
  SweepOn sweep_on = SweepOn::kAuto;
  // Whether work that earlier frames left may be used, and left to later ones; the images are the
  // same. False where times of frames are compared.
  bool reuse = true;
  // Whether no other frame may be in flight with it, so that it alone is to blame for what happens
  // to the device.
  bool alone = false;
};

// What a tool needs to place one light's buffer in the world; see LightInfo in frame.proto.
struct LightReport {
  bool casts_shadows = false;
  glm::dmat4 light_texture_from_world{1.0};
  glm::dmat4 light_view_from_world{1.0};
  glm::dvec3 slice_axis{0.0};
  int slices = 0;
  bool back_to_front = false;
};

struct StageTiming {
  std::string stage;
  double milliseconds = 0.0;
  bool on_device = false;  // timed there, by GL timestamps
};

struct FrameResult {
  std::vector<Image> images;  // in the order of the request
  FramePlan plan;
  std::vector<LightReport> lights;  // one for each light of the scene
  size_t clamped_opacities = 0;
  std::vector<StageTiming> timings;
};

}  // namespace halflight
