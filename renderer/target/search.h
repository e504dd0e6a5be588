// From a target, an error or a time instead of settings, to the frame that meets it: says what to
// render and measure next. Renders and measures nothing itself. docs/target-error.md says how it
// decides; start reading at TargetSearch.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "renderer/error_estimate.h"
#include "renderer/target/candidates.h"
#include "renderer/target/cost_model.h"
#include "renderer/target/knowledge.h"

namespace halflight {

// At least one of the first two; see Target in frame.proto.
struct TargetGoal {
  std::optional<double> max_error;    // relative RMSE, (0, 1]
  std::optional<double> max_time_ms;  // of rendering the frame returned, > 0
  int samples = 1024;                 // to measure errors with at first
};

enum class TargetAction {
  kRender,        // render these settings; where samples > 0, then measure the error
  kMeasureAgain,  // the frame rendered last, with more samples
};

struct TargetStep {
  TargetAction action = TargetAction::kRender;
  Settings settings;
  int samples = 0;
  double expected_milliseconds = 0.0;  // of rendering
  double expected_error = 0.0;         // relative RMSE
};

struct TargetObservation {
  double milliseconds = 0.0;  // of rendering; of no matter after kMeasureAgain
  // Without where nothing was measured. With scattering: of the frame without.
  std::optional<EstimatedFigure> relative_rmse;
  double measurement_ms = 0.0;
};

struct TargetAttempt {
  Settings settings;
  double expected_milliseconds = 0.0;
  double milliseconds = 0.0;
  std::optional<EstimatedFigure> relative_rmse;
  int samples = 0;  // as asked for
  bool met = false;
};

struct TargetOutcome {
  std::vector<TargetAttempt> attempts;  // in order
  std::optional<size_t> returned;       // of them; none before the first was observed
  bool met = false;                     // the same as the returned one's
  std::string reason;                   // where not met: what stood in the way
};

// For one frame. One thread at a time; the cost model and the knowledge may serve other searches at
// the same time, and outlive this one. The same inputs and observations give the same steps.
//
//     while (const std::optional<TargetStep> step = search.Next()) {
//       render these settings, or measure the frame rendered last
//       search.Observe(...);
//       drop the frames of attempts that search.Needs no more
//     }
class TargetSearch {
 public:
  // Frames rendered for one request, at most.
  static constexpr size_t kMaxAttempts = 6;

  // `scene.shadow` and `scene.sampling` are what the request left unset, or fixed (TargetLimits).
  TargetSearch(const Scene& scene, std::span<const ImageRequest> images, const TargetGoal& goal,
               const TargetLimits& limits, CostModel& costs, TargetKnowledge& knowledge);

  // The next step; the same until it was observed. None: see outcome().
  std::optional<TargetStep> Next();

  // Of the step that Next returned last.
  void Observe(const TargetObservation& observation);

  // Whether the frame of an attempt, counted from 0, may still be measured or returned: that of two
  // at most, of one once Next said to render another.
  [[nodiscard]] bool Needs(size_t attempt) const;

  // Valid after Next returned none.
  [[nodiscard]] TargetOutcome outcome() const;

 private:
  // A candidate that was not tried yet, as it looks now.
  struct Prospect {
    const Settings* settings;
    Expected time;
    Expected error;
    double in_time;  // probability of meeting max_time_ms
    double in_both;  // and max_error
  };

  [[nodiscard]] Prospect Look(const Settings& settings) const;
  [[nodiscard]] std::vector<Prospect> Prospects() const;
  [[nodiscard]] std::optional<Prospect> Choose(const std::vector<Prospect>& prospects) const;
  [[nodiscard]] std::optional<Prospect> ChooseForError(
      const std::vector<Prospect>& prospects) const;
  [[nodiscard]] std::optional<Prospect> ChooseForTime(const std::vector<Prospect>& prospects) const;
  [[nodiscard]] bool PaysToMeasureAgain(const std::optional<Prospect>& next) const;
  [[nodiscard]] bool Meets(const TargetAttempt& attempt) const;
  [[nodiscard]] bool IsInTime(const TargetAttempt& attempt) const;
  [[nodiscard]] bool IsBetter(const TargetAttempt& a, const TargetAttempt& b) const;
  // Of the first so many attempts.
  [[nodiscard]] std::optional<size_t> BestOf(size_t attempts) const;
  [[nodiscard]] std::string WhyNotMet() const;

  TargetGoal goal_;
  SceneFeatures features_;
  Candidates candidates_;
  CostModel& costs_;
  TargetKnowledge& knowledge_;

  std::optional<TargetStep> pending_;
  std::vector<TargetAttempt> attempts_;
  int measured_again_ = 0;  // the last attempt
  bool done_ = false;
};

}  // namespace halflight
