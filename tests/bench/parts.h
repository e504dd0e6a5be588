// The parts of the benchmark: which scenes, drawn by whom, how often. Start reading at MeasureAll.
// Leaves out the service; see service.h.
#pragma once

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "renderer/frame_renderer.h"
#include "tests/bench/results.h"

namespace halflight::bench {

struct MeasureOptions {
  std::string data_folder = "tests/data";
  std::string device = "auto";  // as RenderThreadOptions; the service's renderer too
  bool short_form = false;      // small frames, few of them: checks the tool, measures nothing
  int repeats = 15;             // of one frame; the other parts take fewer
  bool device_sizes = false;
  // Called with what is about to be measured.
  std::function<void(const std::string& what)> progress = [](const std::string&) {};
};

// All parts but the service and the goals. The renderer's thread. NotFound for a plume that cannot
// be read, else errors of the renderer.
absl::StatusOr<Results> MeasureAll(FrameRenderer& renderer, const MeasureOptions& options);

}  // namespace halflight::bench
