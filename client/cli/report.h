// What the render command says on stdout: to people in words, with --json to machines.
// Leaves out progress (progress.h) and errors (main.cpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/scene_defaults.h"
#include "client/frame_assembler.h"
#include "halflight/v1/service.pb.h"

namespace halflight::client {

// A frame that was rendered and written.
struct FrameReport {
  std::optional<int64_t> frame;  // its number in a sequence
  std::string input;             // empty: particles that the server already had
  std::vector<std::string> paths;
  double milliseconds = 0;  // from the request (or the frame before) to the last file
};

std::string ChoicesText(const std::vector<Choice>& choices);
// Of a target that was not met: what was reached, and why not more. No full stop.
std::string TargetMissText(const v1::TargetOutcome& outcome);
std::string FrameText(const FrameReport& report, const RenderedFrame& frame);
// One line, its members: frame, input, milliseconds, server_milliseconds, outputs, choices,
// request, metadata, plan, timings; error where it was measured, target where there was one.
std::string FrameJson(const FrameReport& report, const RenderedFrame& frame,
                      const v1::RenderFrameRequest& request, const std::vector<Choice>& choices);

}  // namespace halflight::client
