#include "renderer/render_thread.h"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
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

  void Run(std::promise<absl::StatusOr<DeviceInfo>> started);
  void WarmUp(FrameRenderer& renderer);
  // Waits for a job; false when stopping and none is left.
  bool NextJob(Job& job);

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

bool RenderThread::NextJob(Job& job) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return stopping_ || !jobs_.empty(); });
  if (jobs_.empty()) return false;
  job = std::move(jobs_.front());
  jobs_.pop_front();
  return true;
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
  for (Job job; NextJob(job); job = {}, WarmUp(**renderer)) {
    const std::chrono::duration<double, std::milli> waited = Clock::now() - job.submitted;
    absl::StatusOr<FrameResult> frame = job.stop.stop_requested()
                                            ? absl::CancelledError("frame cancelled")
                                            : (*renderer)->Render(job.request, job.stop);
    if (frame.ok()) frame->timings.insert(frame->timings.begin(), {"queue", waited.count()});
    {
      const std::lock_guard lock(mutex_);
      --unfinished_;
    }
    job.done(std::move(frame));
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrameEngine>> StartRenderThread(const RenderThreadOptions& options) {
  auto engine = std::make_unique<RenderThread>(options);
  if (absl::Status started = engine->Start(); !started.ok()) return started;
  return engine;
}

}  // namespace halflight
