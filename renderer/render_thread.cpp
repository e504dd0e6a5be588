#include "renderer/render_thread.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "renderer/frame_renderer.h"

namespace halflight {

absl::StatusOr<std::unique_ptr<RenderThread>> RenderThread::Start(
    const RenderThreadOptions& options) {
  std::unique_ptr<RenderThread> self(new RenderThread(options.max_queued_frames));
  self->thread_ =
      std::thread([thread = self.get(), device = options.device] { thread->Run(device); });
  std::unique_lock lock(self->mutex_);
  self->changed_.wait(lock, [&] { return self->started_; });
  if (!self->start_status_.ok()) {
    absl::Status status = self->start_status_;
    lock.unlock();
    return status;
  }
  lock.unlock();
  return self;
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
    jobs_.push_back({std::move(request), std::move(stop), std::move(done)});
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

void RenderThread::Run(const std::string& device) {
  absl::StatusOr<std::unique_ptr<FrameRenderer>> renderer = FrameRenderer::Create(device);
  {
    const std::lock_guard lock(mutex_);
    start_status_ = renderer.status();
    if (renderer.ok()) device_ = (*renderer)->device();
    started_ = true;
  }
  changed_.notify_all();
  if (!renderer.ok()) return;

  for (Job job; NextJob(job); job = {}) {
    absl::StatusOr<FrameResult> frame = job.stop.stop_requested()
                                            ? absl::CancelledError("frame cancelled")
                                            : (*renderer)->Render(job.request, job.stop);
    {
      const std::lock_guard lock(mutex_);
      --unfinished_;
    }
    job.done(std::move(frame));
  }
}

}  // namespace halflight
