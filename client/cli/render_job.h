// What a render command has to do, worked out before any server is asked: the request, the files of
// each frame, the particles that are at hand. Leaves out rendering (render_command.cpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/options.h"
#include "client/cli/scene_defaults.h"
#include "client/particles.h"
#include "halflight/v1/service.pb.h"

namespace halflight::client {

struct JobFrame {
  std::optional<int64_t> number;     // in a sequence
  std::string input;                 // empty: particles that the scene names
  std::vector<std::string> outputs;  // one for each output of the request
};

struct RenderJob {
  v1::RenderFrameRequest request;  // of every frame, but for its particles
  std::vector<JobFrame> frames;
  std::vector<Choice> choices;
  // The first frame's, where it has an input.
  std::optional<Particles> first_particles;
};

// Every error of flags, scene file and names is found here, as is every input that is missing; the
// first and the last input are read. Statuses are marked with their exit codes.
absl::StatusOr<RenderJob> PlanRender(const RenderOptions& options);

// Reads one input; attributes for which a flag gives a value of its own are left out.
absl::StatusOr<Particles> ReadInput(const RenderOptions& options, const std::string& path);

}  // namespace halflight::client
