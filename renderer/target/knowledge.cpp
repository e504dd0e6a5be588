#include "renderer/target/knowledge.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace halflight {

namespace {

// What one observation says of a scene's errors outweighs what is known of others': priors are
// within a factor of 1.5 (candidates.cpp), of squares 2.2.
constexpr LearnedSumOptions kErrorOptions{
    .prior_observations = 0.0, .least_gain = 0.5, .spread = 0.8};
constexpr double kLeastErrorDeviation = 0.12;  // of other settings than those seen
// Of the same settings on the next frame, and for each frame more.
constexpr double kRecordDeviation = 0.05;
constexpr double kAgeDeviation = 0.03;
constexpr double kTimeDeviation = 0.1;
constexpr int kOldestRecord = 50;  // frames

double WeightedMean(const std::optional<double>& before, double now) {
  return before ? std::sqrt(*before * now) : now;
}

}  // namespace

TargetKnowledge::TargetKnowledge() {
  for (const TechniqueModel& model : TechniqueModels()) {
    squared_errors_.emplace_back(std::vector<double>(model.error_parts, 1.0), kErrorOptions);
  }
}

void TargetKnowledge::Enter(std::function<void()> begin) {
  {
    const std::lock_guard lock(mutex_);
    if (leading_ && !learned_) {
      waiting_.push_back(std::move(begin));
      return;
    }
    leading_ = true;
  }
  begin();
}

void TargetKnowledge::Settle(bool learned) {
  std::vector<std::function<void()>> begin;
  {
    const std::lock_guard lock(mutex_);
    learned_ |= learned;
    if (learned_) {
      begin.swap(waiting_);
    } else if (!waiting_.empty()) {
      begin.push_back(std::move(waiting_.front()));
      waiting_.erase(waiting_.begin());
    } else {
      leading_ = false;
    }
  }
  for (const std::function<void()>& next : begin) next();
}

const TargetKnowledge::Record* TargetKnowledge::Find(const Settings& settings) const {
  const auto found = std::find_if(records_.begin(), records_.end(), [&](const Record& record) {
    return record.settings == settings;
  });
  return found == records_.end() ? nullptr : &*found;
}

TargetKnowledge::Record& TargetKnowledge::FindOrAdd(const Settings& settings) {
  for (Record& record : records_) {
    if (record.settings == settings) return record;
  }
  return records_.emplace_back(Record{settings, {}, {}, 0});
}

Expected TargetKnowledge::Error(const SceneFeatures& features, const Settings& settings) const {
  const std::vector<double> terms =
      ModelOf(settings.shadow.technique).error_terms(features, settings);
  const std::lock_guard lock(mutex_);
  if (const Record* record = Find(settings); record != nullptr && record->error) {
    return {*record->error, kRecordDeviation + kAgeDeviation * record->age};
  }
  const LearnedSum& sum = squared_errors_[static_cast<size_t>(settings.shadow.technique)];
  return {std::sqrt(sum.Predict(terms)), std::max(kLeastErrorDeviation, 0.5 * sum.spread())};
}

bool TargetKnowledge::IsUntried(ShadowTechniqueKind kind) const {
  const std::lock_guard lock(mutex_);
  return has_frames_ && squared_errors_[static_cast<size_t>(kind)].observations() == 0.0;
}

std::optional<Expected> TargetKnowledge::Time(const Settings& settings) const {
  const std::lock_guard lock(mutex_);
  const Record* record = Find(settings);
  if (record == nullptr || !record->milliseconds) return std::nullopt;
  return Expected{*record->milliseconds, kTimeDeviation + kAgeDeviation * record->age};
}

void TargetKnowledge::LearnError(const SceneFeatures& features, const Settings& settings,
                                 double relative_rmse) {
  if (!(std::isfinite(relative_rmse) && relative_rmse > 0.0)) return;
  const std::vector<double> terms =
      ModelOf(settings.shadow.technique).error_terms(features, settings);
  const std::lock_guard lock(mutex_);
  squared_errors_[static_cast<size_t>(settings.shadow.technique)].Learn(
      terms, relative_rmse * relative_rmse);
  Record& record = FindOrAdd(settings);
  record.error = record.age > 0 ? WeightedMean(record.error, relative_rmse) : relative_rmse;
  record.age = 0;
}

void TargetKnowledge::LearnTime(const Settings& settings, double milliseconds) {
  const std::lock_guard lock(mutex_);
  Record& record = FindOrAdd(settings);
  record.milliseconds = WeightedMean(record.milliseconds, milliseconds);
  record.age = 0;
}

void TargetKnowledge::AgeByOneFrame() {
  const std::lock_guard lock(mutex_);
  has_frames_ = true;
  for (Record& record : records_) ++record.age;
  std::erase_if(records_, [](const Record& record) { return record.age > kOldestRecord; });
}

}  // namespace halflight
