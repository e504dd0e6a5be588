// What was measured, as plain structs. Leaves out what the goals make of it; see goals.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "renderer/frame.h"
#include "tests/bench/contestants.h"
#include "tests/measure/frame_error.h"

namespace halflight::bench {

// One way to draw one scene.
struct Row {
  std::string name;
  Role role = Role::kOurs;
  size_t particles = 0;
  int width = 0;
  int height = 0;
  int slices = 0;                    // asked for
  std::vector<double> milliseconds;  // one a turn, in the order of the turns
  std::vector<StageTiming> stages;   // medians
  std::string failure;               // why there is no frame; then all figures are empty
  std::optional<measure::FrameError> error;

  // Frames a second by the device's own clock: what the stages timed there add up to. None where
  // no stage is.
  [[nodiscard]] std::optional<double> device_frames_per_second() const;
};

// Rows whose turns alternated, so that their times may be divided by one another turn by turn.
using Group = std::vector<Row>;

// A ratio that was aimed at, and what was reached.
struct Goal {
  std::string what;
  double reached;
  double limit;
  bool at_least;    // or at most
  std::string how;  // of which rows

  [[nodiscard]] bool met() const { return at_least ? reached >= limit : reached <= limit; }
};

struct Results {
  Group frame;                   // every contestant
  std::vector<Group> particles;  // a number of particles each
  Group slices;
  std::vector<Group> resolution;  // a size each
  Group turntable;                // pairs of a first frame and those that follow it
  Group service;                  // empty without the service
  std::vector<Group> device;      // the sizes of hardware renderers; else empty
  std::vector<Goal> goals;
};

}  // namespace halflight::bench
