#include "server/frame_search.h"

#include <algorithm>
#include <utility>

namespace halflight {
namespace {

using Clock = std::chrono::steady_clock;

// What counts against max_time_ms: the renderer's own stages.
double RenderMilliseconds(const FrameResult& rendered) {
  double sum = 0.0;
  for (const StageTiming& timing : rendered.timings) {
    sum += timing.stage == "queue" ? 0.0 : timing.milliseconds;
  }
  return sum;
}

}  // namespace

FrameSearch::FrameSearch(const FrameJob& job, CostModel& costs)
    : job_(job),
      begin_(Clock::now()),
      search_(job.request.scene, job.request.images, job.target->goal, job.target->limits, costs,
              *job.target->knowledge) {}

FrameSearch::~FrameSearch() {
  job_.target->knowledge->Settle(over_.has_value() && over_->returned.has_value());
}

std::optional<MeasureJob> FrameSearch::Measurement(int samples) const {
  if (!job_.measure.has_value() || !job_.measure->sample.has_value()) {
    return std::nullopt;
  }
  MeasureJob measure = *job_.measure;
  measure.map = false;
  measure.sample->samples =
      std::min(samples > 0 ? samples : measure.sample->samples, job_.target->max_samples);
  return measure;
}

bool FrameSearch::HasMap(const MadeFrame& frame) const {
  return frame.rendered.images.size() > job_.request.images.size();
}

// An output of the error has the model at every pixel, so it decides wherever a sample does not
// show that the target is missed.
bool FrameSearch::NeedsMap(const MadeFrame& frame) const {
  const std::optional<double>& max_error = job_.target->goal.max_error;
  return job_.measure.has_value() && job_.measure->map && !HasMap(frame) &&
         (over_.has_value() ||
          (max_error.has_value() && frame.error->relative_rmse.low <= *max_error));
}

void FrameSearch::Observe(const MadeFrame& frame) {
  TargetObservation observation;
  observation.milliseconds = RenderMilliseconds(frame.rendered);
  if (frame.error.has_value()) {
    observation.relative_rmse = frame.error->relative_rmse;
    observation.measurement_ms = sampling_ms_;
  }
  search_.Observe(observation);
  step_.reset();
}

std::optional<FramePass> FrameSearch::Next(MadeFrame& frame) {
  const FramePass map{std::nullopt, job_.measure};
  if (step_.has_value()) {
    if (!HasMap(frame)) {
      sampling_ms_ = frame.measurement_ms;
    }
    if (NeedsMap(frame)) {
      return map;
    }
    Observe(frame);
  }
  if (!over_.has_value()) {
    step_ = search_.Next();
    if (step_.has_value() && step_->action == TargetAction::kMeasureAgain) {
      return FramePass{std::nullopt, Measurement(step_->samples)};
    }
    if (step_.has_value()) {
      if (rendered_ > 0) {
        kept_.insert_or_assign(rendered_ - 1, std::move(frame));
      }
      std::erase_if(kept_, [this](const auto& kept) { return !search_.Needs(kept.first); });
      ++rendered_;
      frame = {};
      return FramePass{step_->settings, Measurement(step_->samples)};
    }
    over_ = search_.outcome();
    BringBackReturned(frame);
    if (over_->returned.has_value() && NeedsMap(frame)) {
      return map;
    }
  }
  Finish(frame);
  return std::nullopt;
}

void FrameSearch::BringBackReturned(MadeFrame& frame) {
  if (over_->returned.has_value() && *over_->returned + 1 != rendered_) {
    frame = std::move(kept_.at(*over_->returned));
  }
  kept_.clear();
}

void FrameSearch::Finish(MadeFrame& frame) {
  frame.target = over_;
  if (over_->returned.has_value() && frame.error.has_value()) {
    // A map that followed the search knows better than a sample.
    frame.target->attempts[*over_->returned].relative_rmse = frame.error->relative_rmse;
  }
  const std::chrono::duration<double, std::milli> took = Clock::now() - begin_;
  frame.rendered.timings.push_back({"search", took.count()});
}

}  // namespace halflight
