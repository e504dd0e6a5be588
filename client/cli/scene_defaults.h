// Chooses what neither the flags nor the scene file said: radius, opacity, camera, light; and says
// what it chose. Leaves out everything that the server has a default for.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/particles.h"
#include "halflight/v1/service.pb.h"

namespace halflight::client {

// One line for people: "radius", "0.0455, estimated from the spacing of the particles".
struct Choice {
  std::string name;
  std::string value;
};

// Fills in `request` for particles that all frames of a sequence are judged by: the first frame,
// and the last one where there are several, so that nothing changes from frame to frame. Without
// clouds the camera has to be there. InvalidArgument where something cannot be chosen.
absl::Status FillInScene(const std::vector<const Particles*>& clouds,
                         v1::RenderFrameRequest& request, std::vector<Choice>& choices);

}  // namespace halflight::client
