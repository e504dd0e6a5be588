#include "renderer/render_thread.h"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"

namespace halflight {

namespace {

using Clock = std::chrono::steady_clock;

class RenderThread : public FrameEngine {
 public:
  explicit RenderThread(int max_queued_frames) : max_queued_frames_(max_queued_frames) {}
  ~RenderThread() override;
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;

  // Call once; the engine serves when it returned OK.
  absl::Status Start(const RenderThreadOptions& options);

  absl::Status Submit(FrameRequest request, std::stop_token stop, Done done) override;
  [[nodiscard]] const DeviceInfo& device() const override { return device_; }

 private:
  struct Job {
    FrameRequest request;
    std::stop_token stop;
    Done done;
    Clock::time_point submitted;
  };

  void Run(const RenderThreadOptions& options, std::promise<absl::StatusOr<DeviceInfo>> started);
  // Waits for a job; false when stopping and none is left.
  bool NextJob(Job& job);

  const int max_queued_frames_;
  DeviceInfo device_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;   // guarded by mutex_
  int unfinished_ = 0;     // guarded by mutex_: waiting or rendering
  bool stopping_ = false;  // guarded by mutex_
  std::thread thread_;
};

absl::Status RenderThread::Start(const RenderThreadOptions& options) {
  std::promise<absl::StatusOr<DeviceInfo>> promise;
  std::future<absl::StatusOr<DeviceInfo>> started = promise.get_future();
  thread_ = std::thread(&RenderThread::Run, this, options, std::move(promise));
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
    if (unfinished_ >= max_queued_frames_) {
      return absl::ResourceExhaustedError(absl::StrCat(
          "frame queue: ", unfinished_, " frames wait, allowed: at most ", max_queued_frames_));
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

void RenderThread::Run(const RenderThreadOptions& options,
                       std::promise<absl::StatusOr<DeviceInfo>> started) {
  absl::StatusOr<std::unique_ptr<FrameRenderer>> renderer =
      FrameRenderer::Create(options.device, options.renderer);
  if (!renderer.ok()) {
    started.set_value(renderer.status());
    return;
  }
  started.set_value((*renderer)->device());

  for (Job job; NextJob(job); job = {}) {
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
  auto engine = std::make_unique<RenderThread>(options.max_queued_frames);
  if (absl::Status started = engine->Start(options); !started.ok()) return started;
  return engine;
}

}  // namespace halflight
