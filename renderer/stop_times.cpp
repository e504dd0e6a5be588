#include "renderer/stop_times.h"

#include <algorithm>
#include <utility>

namespace halflight {

StopTimes::Frame::Frame(StopTimes& of, std::stop_token stop)
    : of_(of), on_stop_(std::move(stop), [this] { told_ = Clock::now(); }) {
  const std::lock_guard lock(of_.mutex_);
  of_.frames_.insert(this);
}

StopTimes::Frame::~Frame() {
  const std::lock_guard lock(of_.mutex_);
  of_.frames_.erase(this);
}

std::unique_ptr<StopTimes::Frame> StopTimes::Watch(std::stop_token stop) {
  return std::make_unique<Frame>(*this, std::move(stop));
}

std::optional<StopTimes::Clock::time_point> StopTimes::first() const {
  const std::lock_guard lock(mutex_);
  Clock::time_point first = Clock::time_point::max();
  for (const Frame* frame : frames_) first = std::min(first, frame->told_.load());
  if (first == Clock::time_point::max()) return std::nullopt;
  return first;
}

}  // namespace halflight
