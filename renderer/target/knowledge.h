// What the frames of one sequence have shown of each other: errors and times of settings, and how
// errors grow with settings. Also lets the first frame learn before the others choose.
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "renderer/target/candidates.h"
#include "renderer/target/learned_sum.h"

namespace halflight {

// A figure that is expected, and how sure: ln(true / value) has about this standard deviation.
struct Expected {
  double value = 0.0;
  double deviation = 0.0;
};

// All functions: any thread.
class TargetKnowledge {
 public:
  TargetKnowledge();

  // Calls `begin` once: at once where a frame has settled before, or is the first; else when the
  // frame under way has settled, on that one's thread. Every call is followed by one of Settle.
  void Enter(std::function<void()> begin);
  // The frame that entered is done with, by whatever outcome. Where it learnt nothing (`learned` is
  // false) and none before did, the next one waiting begins in its place.
  void Settle(bool learned);

  // Relative RMSE: of the same settings on a frame before where there is one, else of the model.
  [[nodiscard]] Expected Error(const SceneFeatures& features, const Settings& settings) const;
  // Whether frames were rendered, but none whose error was measured with this technique: a try is
  // then worth more than this frame's time.
  [[nodiscard]] bool IsUntried(ShadowTechniqueKind kind) const;
  // Milliseconds of the same settings on a frame before.
  [[nodiscard]] std::optional<Expected> Time(const Settings& settings) const;

  void LearnError(const SceneFeatures& features, const Settings& settings, double relative_rmse);
  void LearnTime(const Settings& settings, double milliseconds);
  // What was learnt so far is a frame older from here on.
  void AgeByOneFrame();

 private:
  struct Record {
    Settings settings;
    std::optional<double> error;
    std::optional<double> milliseconds;
    int age = 0;  // frames since it was seen last
  };

  // The record of these settings, or null.
  [[nodiscard]] const Record* Find(const Settings& settings) const;
  Record& FindOrAdd(const Settings& settings);

  mutable std::mutex mutex_;
  std::vector<LearnedSum> squared_errors_;  // by technique
  std::vector<Record> records_;
  bool has_frames_ = false;

  bool leading_ = false;
  bool learned_ = false;
  std::vector<std::function<void()>> waiting_;
};

}  // namespace halflight
