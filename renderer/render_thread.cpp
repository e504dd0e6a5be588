#include "renderer/render_thread.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <future>
#include <iterator>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "renderer/device_fault.h"
#include "renderer/device_restart.h"
#include "renderer/gl/object.h"
#include "renderer/stop_times.h"
#include "renderer/warm_up.h"

namespace halflight {

namespace {

using Clock = std::chrono::steady_clock;

// How soon the thread looks again while the device works.
constexpr std::chrono::milliseconds kPatience(1);

class RenderThread : public FrameEngine {
 public:
  explicit RenderThread(const RenderThreadOptions& options) : options_(options) {}
  ~RenderThread() override;
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;

  // Call once; the engine serves when it returned OK.
  absl::Status Start();

  absl::Status Submit(FrameRequest request, std::stop_token stop, Done done) override;
  [[nodiscard]] const DeviceInfo& device() const override { return device_; }
  [[nodiscard]] int frames_in_flight() const override { return frames_in_flight_; }
  [[nodiscard]] EngineState state() const override;

 private:
  struct Job {
    FrameRequest request;
    std::stop_token stop;
    Done done;
    Clock::time_point submitted;
    bool counts = true;  // among those that may wait or render at once
  };

  // A job whose frame was begun, or failed to be.
  struct Flight {
    Job job;  // without its request
    bool alone = false;
    double queued_ms = 0.0;
    std::unique_ptr<StopTimes::Frame> watched;
    absl::StatusOr<std::unique_ptr<FrameRenderer::Begun>> frame;
  };

  // Frames that were begun, the oldest first, and cancelled ones that the device still draws.
  struct Flights {
    std::deque<Flight> frames;
    std::deque<Flight> cancelled;

    // All that the device is busy with: cancelled ones take their places until it is through with
    // them, so that no client can have it given work without end.
    [[nodiscard]] size_t count() const { return frames.size() + cancelled.size(); }
    [[nodiscard]] bool alone() const {
      const auto is_alone = [](const Flight& flight) { return flight.alone; };
      return std::any_of(frames.begin(), frames.end(), is_alone) ||
             std::any_of(cancelled.begin(), cancelled.end(), is_alone);
    }
    // What those in flight are told of `status`. Of a reset any of the cancelled may be the cause
    // as well, of whom nobody asks any more: then no other is a suspect. One that is the cause will
    // be found the next time.
    [[nodiscard]] absl::Status Told(const absl::Status& status) const {
      return IsDeviceReset(status) && !cancelled.empty() ? DeviceResetError(true) : status;
    }
  };

  void Run(std::promise<absl::Status> started);
  // Until the engine stops, or with an error once the device was reset.
  absl::Status Serve(FrameRenderer& renderer);
  // From now on there are no frames.
  void End(const absl::Status& why);
  Job WarmUpJob();
  // What warms up now, if anything does: another may begin only when no job waits.
  void StopWarmUp();
  // Of those that wait; they need not do so until it is their turn.
  void AnswerStopped();
  // The next job, if it may be begun beside these. Waits for one where there are none; none when
  // stopping and none is left.
  std::optional<Job> NextJob(const FrameRenderer& renderer, const Flights& flights);
  Flight Begin(FrameRenderer& renderer, Job job);
  void Finish(FrameRenderer& renderer, Flights& flights);
  void Answer(const Job& job, absl::StatusOr<FrameResult> frame);

  const RenderThreadOptions options_;
  DeviceInfo device_;         // set before the engine serves
  int frames_in_flight_ = 1;  // as well
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;                                  // guarded by mutex_
  int unfinished_ = 0;                                    // guarded by mutex_: waiting or rendering
  bool stopping_ = false;                                 // guarded by mutex_
  absl::Status end_;                                      // guarded by mutex_
  std::optional<Clock::time_point> starting_anew_since_;  // guarded by mutex_
  uint64_t resets_ = 0;                                   // guarded by mutex_
  std::stop_source warming_up_{std::nostopstate};         // guarded by mutex_: of WarmUpJob
  StopTimes stop_times_;
  std::deque<FrameRequest> warm_up_;  // of the thread's own
  std::thread thread_;
};

absl::Status RenderThread::Start() {
  std::promise<absl::Status> promise;
  std::future<absl::Status> started = promise.get_future();
  thread_ = std::thread(&RenderThread::Run, this, std::move(promise));
  return started.get();
}

RenderThread::~RenderThread() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  StopWarmUp();
  if (thread_.joinable()) thread_.join();
}

absl::Status RenderThread::Submit(FrameRequest request, std::stop_token stop, Done done) {
  {
    const std::lock_guard lock(mutex_);
    if (!end_.ok()) return end_;
    if (stopping_) return absl::UnavailableError("the renderer is shutting down");
    if (unfinished_ >= options_.max_queued_frames) {
      return absl::ResourceExhaustedError(absl::StrCat("frame queue: ", unfinished_,
                                                       " frames wait, allowed: at most ",
                                                       options_.max_queued_frames));
    }
    ++unfinished_;
    jobs_.push_back({std::move(request), std::move(stop), std::move(done), Clock::now()});
  }
  changed_.notify_all();
  StopWarmUp();
  return absl::OkStatus();
}

EngineState RenderThread::state() const {
  const gl::Held held = gl::HeldMemory();
  EngineState state{.gl_objects = held.objects,
                    .gl_bytes = held.bytes,
                    .device_resets = 0,
                    .end = {},
                    .overdue_since = stop_times_.first()};
  const std::lock_guard lock(mutex_);
  state.device_resets = resets_;
  state.end = end_;
  if (starting_anew_since_) {
    state.overdue_since =
        std::min(state.overdue_since.value_or(*starting_anew_since_), *starting_anew_since_);
  }
  return state;
}

std::optional<RenderThread::Job> RenderThread::NextJob(const FrameRenderer& renderer,
                                                       const Flights& flights) {
  std::unique_lock lock(mutex_);
  if (flights.count() == 0) {
    changed_.wait(lock, [&] { return stopping_ || !jobs_.empty() || !warm_up_.empty(); });
    if (jobs_.empty() && !stopping_ && !warm_up_.empty()) return WarmUpJob();
  }
  if (jobs_.empty()) return std::nullopt;
  const FrameRequest& next = jobs_.front().request;
  if (flights.alone() || (next.alone && flights.count() > 0)) return std::nullopt;
  // One that the CPU draws would keep them waiting.
  if (!flights.frames.empty() && !renderer.DrawsOnDevice(next)) return std::nullopt;
  Job job = std::move(jobs_.front());
  jobs_.pop_front();
  return job;
}

void RenderThread::AnswerStopped() {
  std::vector<Job> stopped;
  {
    const std::lock_guard lock(mutex_);
    const auto first = std::stable_partition(
        jobs_.begin(), jobs_.end(), [](const Job& job) { return !job.stop.stop_requested(); });
    std::move(first, jobs_.end(), std::back_inserter(stopped));
    jobs_.erase(first, jobs_.end());
  }
  for (const Job& job : stopped) Answer(job, absl::CancelledError("frame cancelled"));
}

RenderThread::Flight RenderThread::Begin(FrameRenderer& renderer, Job job) {
  const std::chrono::duration<double, std::milli> waited = Clock::now() - job.submitted;
  Flight flight{std::move(job), false, waited.count(), nullptr,
                absl::CancelledError("frame cancelled")};
  if (flight.job.stop.stop_requested()) return flight;
  flight.alone = flight.job.request.alone;
  flight.watched = stop_times_.Watch(flight.job.stop);
  flight.frame = renderer.Begin(std::move(flight.job.request), flight.job.stop);
  return flight;
}

void RenderThread::Answer(const Job& job, absl::StatusOr<FrameResult> frame) {
  if (job.counts) {
    const std::lock_guard lock(mutex_);
    --unfinished_;
  }
  job.done(std::move(frame));
}

// The oldest.
void RenderThread::Finish(FrameRenderer& renderer, Flights& flights) {
  Flight flight = std::move(flights.frames.front());
  flights.frames.pop_front();
  if (!flight.frame.ok()) {
    Answer(flight.job, flights.Told(flight.frame.status()));
  } else if (flight.job.stop.stop_requested() && !FrameRenderer::IsDrawn(**flight.frame, {})) {
    Answer(flight.job, absl::CancelledError("frame cancelled"));
    flights.cancelled.push_back(std::move(flight));
  } else {
    absl::StatusOr<FrameResult> frame = renderer.Finish(*std::move(flight.frame));
    flight.watched.reset();
    if (frame.ok()) {
      frame->timings.insert(frame->timings.begin(), {"queue", flight.queued_ms});
      Answer(flight.job, std::move(frame));
    } else {
      Answer(flight.job, flights.Told(frame.status()));
    }
  }
}

// Begins what waits, as long as another may be in flight, and finishes the oldest as soon as the
// device has come to its end.
absl::Status RenderThread::Serve(FrameRenderer& renderer) {
  Flights flights;
  for (;;) {
    // A reset ends whatever is drawn: what it ended is still there when it is noticed.
    const auto look = flights.frames.empty() ? kPatience : std::chrono::milliseconds(0);
    const auto drawn = std::partition(
        flights.cancelled.begin(), flights.cancelled.end(),
        [look](const Flight& flight) { return !FrameRenderer::IsDrawn(**flight.frame, look); });
    if (absl::Status reset = renderer.CheckReset(); !reset.ok()) {
      for (const Flight& flight : flights.frames) Answer(flight.job, flights.Told(reset));
      return reset;
    }
    flights.cancelled.erase(drawn, flights.cancelled.end());
    AnswerStopped();
    bool begun = false;
    if (flights.count() < renderer.frames_in_flight()) {
      std::optional<Job> job = NextJob(renderer, flights);
      begun = job.has_value();
      if (job) flights.frames.push_back(Begin(renderer, *std::move(job)));
    }
    if (flights.frames.empty()) {
      const std::lock_guard lock(mutex_);
      if (stopping_ && jobs_.empty()) return absl::OkStatus();
      continue;
    }
    const Flight& oldest = flights.frames.front();
    const auto wait = begun ? std::chrono::milliseconds(0) : kPatience;
    if (oldest.frame.ok() && !renderer.CanFinish(**oldest.frame, wait)) continue;
    Finish(renderer, flights);
  }
}

void RenderThread::End(const absl::Status& why) {
  std::deque<Job> jobs;
  {
    const std::lock_guard lock(mutex_);
    end_ = why;
    jobs.swap(jobs_);
  }
  for (const Job& job : jobs) Answer(job, why);
}

// What is drawn where nobody waits: a request ends it, so as not to wait for what others may want.
// Under the mutex.
RenderThread::Job RenderThread::WarmUpJob() {
  warming_up_ = {};
  return {warm_up_.front(), warming_up_.get_token(),
          [this](const absl::StatusOr<FrameResult>& frame) {
            // The turn of one that was stopped comes again. Whoever asks for such a frame is told
            // what is wrong with it.
            if (!absl::IsCancelled(frame.status())) warm_up_.pop_front();
          },
          Clock::now(), /*counts=*/false};
}

void RenderThread::StopWarmUp() {
  const std::stop_source warming_up = [this] {
    const std::lock_guard lock(mutex_);
    return warming_up_;
  }();
  warming_up.request_stop();
}

void RenderThread::Run(std::promise<absl::Status> started) {
  absl::StatusOr<std::unique_ptr<FrameRenderer>> renderer =
      FrameRenderer::Create(options_.device, options_.renderer);
  if (!renderer.ok()) {
    started.set_value(renderer.status());
    return;
  }
  device_ = (*renderer)->device();
  frames_in_flight_ = static_cast<int>((*renderer)->frames_in_flight());
  started.set_value(absl::OkStatus());

  if (options_.warm_up) {
    const std::vector<FrameRequest> frames = WarmUpFrames();
    warm_up_.assign(frames.begin(), frames.end());
  }
  while (!Serve(**renderer).ok()) {
    {
      const std::lock_guard lock(mutex_);
      ++resets_;
      starting_anew_since_ = Clock::now();
    }
    renderer->reset();
    renderer = StartDeviceAnew(options_, device_, [this](std::chrono::milliseconds wait) {
      std::unique_lock lock(mutex_);
      return !changed_.wait_for(lock, wait, [this] { return stopping_; });
    });
    {
      const std::lock_guard lock(mutex_);
      starting_anew_since_.reset();
    }
    if (!renderer.ok()) return End(renderer.status());
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrameEngine>> StartRenderThread(const RenderThreadOptions& options) {
  auto engine = std::make_unique<RenderThread>(options);
  if (absl::Status started = engine->Start(); !started.ok()) return started;
  return engine;
}

}  // namespace halflight
