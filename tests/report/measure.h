// Draws every scene with every setting, and keeps what it took and how wrong it was.
// Leaves out what to make of it; see advice.h.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame_renderer.h"
#include "tests/measure/frame_error.h"
#include "tests/report/scenes.h"
#include "tests/report/settings.h"

namespace halflight::report {

struct Measurement {
  size_t scene;    // in Results::scenes
  size_t setting;  // in Results::settings
  int repeats;
  double milliseconds;  // median
  // To the baseline setting: of the matrix, on the same scene; of the scaling part, on its baseline
  // scene. Median of the ratios within a repeat.
  double time_ratio;
  measure::FrameError error;
  bool on_front;  // among the measurements of its scene
};

struct Results {
  std::vector<ReportScene> scenes;
  std::vector<Setting> settings;
  std::vector<Measurement> measurements;  // by scene, then in the order of the settings
};

struct MeasureOptions {
  int repeats = 5;          // of the matrix
  int scaling_repeats = 3;  // of the scaling part, whose frames take seconds
  // Called with what is about to be measured.
  std::function<void(const std::string& what)> progress = [](const std::string&) {};
};

// The renderer's thread. Errors as FrameRenderer::Render.
absl::StatusOr<Results> MeasureAll(FrameRenderer& renderer, std::vector<ReportScene> scenes,
                                   std::vector<Setting> settings, const MeasureOptions& options);

}  // namespace halflight::report
