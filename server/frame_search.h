// The loop of a frame with a target, pass by pass: settings to render, errors to measure, frames to
// keep, until one is to be returned. Renders and measures nothing itself, and chooses no settings:
// TargetSearch does.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>

#include "renderer/target/search.h"
#include "server/convert/convert_frame.h"
#include "server/made_frame.h"

namespace halflight {

// What is to be done with a frame next.
struct FramePass {
  std::optional<Settings> settings;   // to render it with; none: it is there
  std::optional<MeasureJob> measure;  // then; none: nothing is measured
};

// One thread at a time.
class FrameSearch {
 public:
  // The job has a target, has entered its knowledge, and outlives this one, as the cost model does.
  FrameSearch(const FrameJob& job, CostModel& costs);
  // Settles the job's knowledge.
  ~FrameSearch();
  FrameSearch(const FrameSearch&) = delete;
  FrameSearch& operator=(const FrameSearch&) = delete;
  FrameSearch(FrameSearch&&) = delete;
  FrameSearch& operator=(FrameSearch&&) = delete;

  // The next pass over `frame`, which is as the pass before has left it. None: it is the one to
  // return, complete with its outcome; nothing could be rendered where that returns none.
  std::optional<FramePass> Next(MadeFrame& frame);

 private:
  [[nodiscard]] std::optional<MeasureJob> Measurement(int samples) const;
  [[nodiscard]] bool HasMap(const MadeFrame& frame) const;
  [[nodiscard]] bool NeedsMap(const MadeFrame& frame) const;
  void Observe(const MadeFrame& frame);
  void BringBackReturned(MadeFrame& frame);
  void Finish(MadeFrame& frame);

  const FrameJob& job_;
  const std::chrono::steady_clock::time_point begin_;
  TargetSearch search_;

  std::optional<TargetStep> step_;     // under way
  double sampling_ms_ = 0.0;           // the step's measurement, before the map that followed it
  size_t rendered_ = 0;                // attempts, the frame at hand among them
  std::map<size_t, MadeFrame> kept_;   // those of other attempts that may be returned
  std::optional<TargetOutcome> over_;  // once the search is
};

}  // namespace halflight
