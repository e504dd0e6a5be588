#include "renderer/render_thread.h"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "renderer/warm_up.h"

namespace halflight {

namespace {

using Clock = std::chrono::steady_clock;

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

 private:
  struct Job {
    FrameRequest request;
    std::stop_token stop;
    Done done;
    Clock::time_point submitted;
  };

  // A job whose frame was begun, or failed to be.
  struct Flight {
    Job job;  // without its request
    double queued_ms = 0.0;
    absl::StatusOr<std::unique_ptr<FrameRenderer::Begun>> frame;
  };

  void Run(std::promise<absl::StatusOr<DeviceInfo>> started);
  void Serve(FrameRenderer& renderer);
  void WarmUp(FrameRenderer& renderer);
  // The next job. `idle`: waits for it; none when stopping and none is left. Otherwise none where
  // none is there, or where it would keep frames in flight waiting.
  std::optional<Job> NextJob(const FrameRenderer& renderer, bool idle);
  static Flight Begin(FrameRenderer& renderer, Job job);
  void Finish(FrameRenderer& renderer, Flight flight);

  const RenderThreadOptions options_;
  DeviceInfo device_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;              // guarded by mutex_
  int unfinished_ = 0;                // guarded by mutex_: waiting or rendering
  bool stopping_ = false;             // guarded by mutex_
  std::deque<FrameRequest> warm_up_;  // of the thread's own
  std::thread thread_;
};

absl::Status RenderThread::Start() {
  std::promise<absl::StatusOr<DeviceInfo>> promise;
  std::future<absl::StatusOr<DeviceInfo>> started = promise.get_future();
  thread_ = std::thread(&RenderThread::Run, this, std::move(promise));
  const absl::StatusOr<DeviceInfo> info = started.get();
  if (!info.ok()) return info.status();
  device_ = *info;
  return absl::OkStatus();
}

RenderThread::~RenderThread() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

absl::Status RenderThread::Submit(FrameRequest request, std::stop_token stop, Done done) {
  {
    const std::lock_guard lock(mutex_);
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
  return absl::OkStatus();
}

std::optional<RenderThread::Job> RenderThread::NextJob(const FrameRenderer& renderer, bool idle) {
  std::unique_lock lock(mutex_);
  if (idle) changed_.wait(lock, [&] { return stopping_ || !jobs_.empty(); });
  if (jobs_.empty()) return std::nullopt;
  if (!idle && !renderer.DrawsOnDevice(jobs_.front().request)) return std::nullopt;
  Job job = std::move(jobs_.front());
  jobs_.pop_front();
  return job;
}

RenderThread::Flight RenderThread::Begin(FrameRenderer& renderer, Job job) {
  const std::chrono::duration<double, std::milli> waited = Clock::now() - job.submitted;
  if (job.stop.stop_requested()) {
    return {std::move(job), waited.count(), absl::CancelledError("frame cancelled")};
  }
  auto frame = renderer.Begin(std::move(job.request), job.stop);
  return {std::move(job), waited.count(), std::move(frame)};
}

void RenderThread::Finish(FrameRenderer& renderer, Flight flight) {
  absl::StatusOr<FrameResult> frame =
      flight.frame.ok() ? renderer.Finish(*std::move(flight.frame)) : flight.frame.status();
  if (frame.ok()) frame->timings.insert(frame->timings.begin(), {"queue", flight.queued_ms});
  {
    const std::lock_guard lock(mutex_);
    --unfinished_;
  }
  flight.job.done(std::move(frame));
}

// Begins what waits, as long as another may be in flight, and finishes the oldest as soon as the
// device has come to its end.
void RenderThread::Serve(FrameRenderer& renderer) {
  constexpr std::chrono::milliseconds kPatience(1);  // how soon a job is noticed meanwhile
  std::deque<Flight> flights;                        // the oldest first
  for (;;) {
    bool begun = false;
    if (flights.size() < renderer.frames_in_flight()) {
      std::optional<Job> job = NextJob(renderer, flights.empty());
      begun = job.has_value();
      if (job) flights.push_back(Begin(renderer, *std::move(job)));
      if (flights.empty()) return;
    }
    const Flight& oldest = flights.front();
    const auto wait = begun ? std::chrono::milliseconds(0) : kPatience;
    if (oldest.frame.ok() && !renderer.CanFinish(**oldest.frame, wait)) continue;
    Flight flight = std::move(flights.front());
    flights.pop_front();
    Finish(renderer, std::move(flight));
    if (flights.empty()) WarmUp(renderer);
  }
}

// Ends where there is a job: what a request wants goes before what others may want.
void RenderThread::WarmUp(FrameRenderer& renderer) {
  while (!warm_up_.empty()) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_ || !jobs_.empty()) return;
    }
    // Whoever asks for such a frame is told what is wrong with it.
    renderer.Render(warm_up_.front(), {}).IgnoreError();
    warm_up_.pop_front();
  }
}

void RenderThread::Run(std::promise<absl::StatusOr<DeviceInfo>> started) {
  absl::StatusOr<std::unique_ptr<FrameRenderer>> renderer =
      FrameRenderer::Create(options_.device, options_.renderer);
  if (!renderer.ok()) {
    started.set_value(renderer.status());
    return;
  }
  started.set_value((*renderer)->device());

  if (options_.warm_up) {
    const std::vector<FrameRequest> frames = WarmUpFrames();
    warm_up_.assign(frames.begin(), frames.end());
    WarmUp(**renderer);
  }
  Serve(**renderer);
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrameEngine>> StartRenderThread(const RenderThreadOptions& options) {
  auto engine = std::make_unique<RenderThread>(options);
  if (absl::Status started = engine->Start(); !started.ok()) return started;
  return engine;
}

}  // namespace halflight
