#include "renderer/target/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace halflight {

namespace {

constexpr double kHopeless = 0.02;      // probability below which a frame is not worth rendering
constexpr double kLikely = 0.7;         // of staying within max_time_ms, to be chosen for its error
constexpr double kWeightOfTries = 0.3;  // of a miss that a sequence learns from
constexpr double kLeastDeviation = 0.1;  // of times, ln
// With 1024 samples the upper end of an interval lies about so far above the figure, ln.
constexpr double kHalfInterval = 0.06;
constexpr int kMostMeasurementsAgain = 2;
constexpr int kMoreSamples = 4;  // times as many: intervals half as wide

// That a figure expected so is at most `limit`, where its logarithm is normal.
double ProbabilityWithin(const Expected& expected, double limit) {
  return 0.5 *
         std::erfc(std::log(expected.value / limit) / (expected.deviation * std::numbers::sqrt2));
}

// The smallest by `key`, the first of equals.
template <typename Range, typename Key>
auto SmallestBy(const Range& range, const Key& key) {
  return std::min_element(range.begin(), range.end(),
                          [&](const auto& a, const auto& b) { return key(a) < key(b); });
}

}  // namespace

TargetSearch::TargetSearch(const Scene& scene, std::span<const ImageRequest> images,
                           const TargetGoal& goal, const TargetLimits& limits, CostModel& costs,
                           TargetKnowledge& knowledge)
    : goal_(goal),
      features_(FeaturesOf(scene)),
      candidates_(ListCandidates(scene, features_, images, limits)),
      costs_(costs),
      knowledge_(knowledge) {}

TargetSearch::Prospect TargetSearch::Look(const Settings& settings) const {
  const ShadowTechniqueKind technique = settings.shadow.technique;
  Prospect prospect{&settings, {}, knowledge_.Error(features_, settings), 1.0, 1.0};
  if (const std::optional<Expected> seen = knowledge_.Time(settings)) {
    prospect.time = *seen;
  } else {
    prospect.time = {costs_.Predict(features_, settings),
                     std::max(kLeastDeviation, costs_.spread(technique))};
    // What the technique's last frame took more than expected, this one will too.
    for (const TargetAttempt& attempt : attempts_) {
      if (attempt.settings.shadow.technique != technique) continue;
      prospect.time = {costs_.Predict(features_, settings) * attempt.milliseconds /
                           costs_.Predict(features_, attempt.settings),
                       kLeastDeviation};
    }
  }
  if (goal_.max_time_ms) prospect.in_time = ProbabilityWithin(prospect.time, *goal_.max_time_ms);
  prospect.in_both = prospect.in_time;
  if (goal_.max_error) {
    prospect.in_both *=
        ProbabilityWithin(prospect.error, *goal_.max_error * std::exp(-kHalfInterval));
  }
  return prospect;
}

std::vector<TargetSearch::Prospect> TargetSearch::Prospects() const {
  std::vector<Prospect> prospects;
  for (const Settings& settings : candidates_.settings) {
    const bool tried =
        std::any_of(attempts_.begin(), attempts_.end(),
                    [&](const TargetAttempt& attempt) { return attempt.settings == settings; });
    if (!tried) prospects.push_back(Look(settings));
  }
  return prospects;
}

// The smallest error among what will likely be in time; where nothing is, the likeliest; where
// nothing can be, the fastest, once.
std::optional<TargetSearch::Prospect> TargetSearch::ChooseForTime(
    const std::vector<Prospect>& prospects) const {
  const auto likeliest = SmallestBy(prospects, [](const Prospect& p) { return -p.in_time; });
  if (likeliest->in_time < kHopeless) {
    if (!attempts_.empty()) return std::nullopt;
    return *SmallestBy(prospects, [](const Prospect& p) { return p.time.value; });
  }
  if (likeliest->in_time < kLikely) return *likeliest;
  const auto error = [&](const Prospect& p) {
    return p.in_time < kLikely ? std::numeric_limits<double>::infinity() : p.error.value;
  };
  const double least = error(*SmallestBy(prospects, error));
  constexpr double kAsGood = 1.02;
  return *SmallestBy(prospects, [&](const Prospect& p) {
    return error(p) > kAsGood * least ? std::numeric_limits<double>::infinity() : p.time.value;
  });
}

// The least time until the target is met, on average: one's own, and where that misses, that of the
// surest one, which counts for less where the miss would tell later frames about a technique not
// tried before. The last attempt is the surest one's.
std::optional<TargetSearch::Prospect> TargetSearch::ChooseForError(
    const std::vector<Prospect>& prospects) const {
  const auto surest = SmallestBy(prospects, [](const Prospect& p) { return -p.in_both; });
  if (surest->in_both < kHopeless) {
    if (!attempts_.empty()) return std::nullopt;
    return ChooseForTime(prospects);  // the best there is: what stays in time with the least error
  }
  if (attempts_.size() + 1 == kMaxAttempts) return *surest;
  const double measurement = costs_.PredictMeasurement(features_, goal_.samples);
  const double otherwise = surest->time.value + measurement;
  return *SmallestBy(prospects, [&](const Prospect& p) {
    if (p.in_both < kHopeless) return std::numeric_limits<double>::infinity();
    const double weight = knowledge_.IsUntried(p.settings->shadow.technique) ? kWeightOfTries : 1.0;
    return p.time.value + measurement + weight * (1.0 - p.in_both) * otherwise;
  });
}

std::optional<TargetSearch::Prospect> TargetSearch::Choose(
    const std::vector<Prospect>& prospects) const {
  if (prospects.empty() || attempts_.size() == kMaxAttempts) return std::nullopt;
  return goal_.max_error ? ChooseForError(prospects) : ChooseForTime(prospects);
}

// The interval of the last frame's error straddles the goal: more samples may show that it is met,
// the likelier where its middle is below. They come before what costs more, and before giving up.
bool TargetSearch::PaysToMeasureAgain(const std::optional<Prospect>& next) const {
  if (attempts_.empty() || measured_again_ == kMostMeasurementsAgain) return false;
  const TargetAttempt& last = attempts_.back();
  if (!goal_.max_error || !last.relative_rmse || last.met || !IsInTime(last)) return false;
  const EstimatedFigure& error = *last.relative_rmse;
  if (!(error.low <= *goal_.max_error && *goal_.max_error < error.high)) return false;
  if (!next) return true;
  const double cost = costs_.PredictMeasurement(features_, 1.0 * last.samples * kMoreSamples);
  return error.value <= *goal_.max_error && cost < next->time.value;
}

std::optional<TargetStep> TargetSearch::Next() {
  if (pending_ || done_) return pending_;
  std::optional<Prospect> next;
  if (attempts_.empty() || !attempts_[*BestOf(attempts_.size())].met) {
    next = Choose(Prospects());
    if (PaysToMeasureAgain(next)) {
      const TargetAttempt& last = attempts_.back();
      pending_ = TargetStep{TargetAction::kMeasureAgain, last.settings, last.samples * kMoreSamples,
                            last.milliseconds, last.relative_rmse->value};
      return pending_;
    }
  }
  if (!next) {
    done_ = true;
    knowledge_.AgeByOneFrame();
    return std::nullopt;
  }
  pending_ = TargetStep{TargetAction::kRender, *next->settings, goal_.max_error ? goal_.samples : 0,
                        next->time.value, next->error.value};
  return pending_;
}

void TargetSearch::Observe(const TargetObservation& observation) {
  const TargetStep step = *std::exchange(pending_, std::nullopt);
  if (step.action == TargetAction::kRender) {
    attempts_.push_back({step.settings, step.expected_milliseconds, observation.milliseconds,
                         observation.relative_rmse, step.samples, false});
    measured_again_ = 0;
    costs_.Learn(features_, step.settings, observation.milliseconds);
  } else {
    ++measured_again_;
    attempts_.back().relative_rmse = observation.relative_rmse;
    attempts_.back().samples = step.samples;
  }
  if (observation.relative_rmse) {
    knowledge_.LearnError(features_, step.settings, observation.relative_rmse->value);
    if (step.samples > 0) {
      costs_.LearnMeasurement(features_, step.samples, observation.measurement_ms);
    }
  }
  if (step.action == TargetAction::kRender) {
    knowledge_.LearnTime(step.settings, observation.milliseconds);
  }
  attempts_.back().met = Meets(attempts_.back());
}

bool TargetSearch::IsInTime(const TargetAttempt& attempt) const {
  return !goal_.max_time_ms || attempt.milliseconds <= *goal_.max_time_ms;
}

bool TargetSearch::Meets(const TargetAttempt& attempt) const {
  const bool within = !goal_.max_error ||
                      (attempt.relative_rmse && attempt.relative_rmse->high <= *goal_.max_error);
  return within && IsInTime(attempt);
}

// What meets the target, then what is in time; of those that meet it the fastest, else the smallest
// error, or without errors and out of time the fastest.
bool TargetSearch::IsBetter(const TargetAttempt& a, const TargetAttempt& b) const {
  if (a.met != b.met) return a.met;
  if (IsInTime(a) != IsInTime(b)) return IsInTime(a);
  const bool by_error = !a.met && IsInTime(a) && a.relative_rmse && b.relative_rmse;
  if (!by_error) return a.milliseconds < b.milliseconds;
  return a.relative_rmse->value < b.relative_rmse->value || std::isnan(b.relative_rmse->value);
}

std::optional<size_t> TargetSearch::BestOf(size_t attempts) const {
  if (attempts == 0) return std::nullopt;
  size_t best = 0;
  for (size_t i = 1; i < attempts; ++i) {
    if (IsBetter(attempts_[i], attempts_[best])) best = i;
  }
  return best;
}

bool TargetSearch::Needs(size_t attempt) const {
  if (attempt >= attempts_.size()) return false;
  const bool is_over = done_ || (pending_ && pending_->action == TargetAction::kRender);
  if (is_over) return attempt == BestOf(attempts_.size());
  // Measured again, the last one may turn out worse than the best before it.
  return attempt + 1 == attempts_.size() || attempt == BestOf(attempts_.size() - 1);
}

std::string TargetSearch::WhyNotMet() const {
  if (candidates_.settings.empty()) return absl::StrJoin(candidates_.refusals, "; ");
  std::vector<std::string> reasons;
  const std::vector<Prospect> left = Prospects();
  if (attempts_.size() == kMaxAttempts) {
    reasons.push_back(absl::StrCat(kMaxAttempts, " frames were rendered, the most for a request"));
  }
  if (left.empty()) {
    reasons.emplace_back("no other settings are left to try");
  } else if (goal_.max_error) {
    const auto likely = [&](const Prospect& p) { return p.error.value <= *goal_.max_error; };
    const auto time = [&](const Prospect& p) {
      return likely(p) ? p.time.value : std::numeric_limits<double>::infinity();
    };
    const auto fastest = SmallestBy(left, time);
    if (likely(*fastest)) {
      reasons.push_back(absl::StrCat(Describe(*fastest->settings), " is expected to come within ",
                                     *goal_.max_error, ", in ", fastest->time.value, " ms"));
      if (goal_.max_time_ms) absl::StrAppend(&reasons.back(), " of ", *goal_.max_time_ms);
    } else {
      const auto best = SmallestBy(left, [](const Prospect& p) { return p.error.value; });
      reasons.push_back(absl::StrCat("of the settings left ", Describe(*best->settings),
                                     " comes nearest, expected at an error of ",
                                     best->error.value));
    }
  } else {
    const auto fastest = SmallestBy(left, [](const Prospect& p) { return p.time.value; });
    reasons.push_back(absl::StrCat("the fastest settings left, ", Describe(*fastest->settings),
                                   ", are expected to take ", fastest->time.value, " ms of ",
                                   *goal_.max_time_ms));
  }
  if (goal_.max_error) {
    reasons.insert(reasons.end(), candidates_.refusals.begin(), candidates_.refusals.end());
  }
  return absl::StrJoin(reasons, "; ");
}

TargetOutcome TargetSearch::outcome() const {
  TargetOutcome outcome;
  outcome.attempts = attempts_;
  outcome.returned = BestOf(attempts_.size());
  outcome.met = outcome.returned && attempts_[*outcome.returned].met;
  if (!outcome.met) outcome.reason = WhyNotMet();
  return outcome;
}

}  // namespace halflight
