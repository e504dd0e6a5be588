// The one thread that owns the GL context, fed through a bounded queue.
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "renderer/frame_engine.h"

namespace halflight {

struct RenderThreadOptions {
  // "auto": a GPU if there is one, else the software renderer; "software"; or one of the GPUs as
  // "uuid:<32 hex digits>", "cuda:<index>", "drm:<path of its node>".
  std::string device = "auto";
  int max_queued_frames = 64;  // waiting or rendering
};

class RenderThread : public FrameEngine {
 public:
  // Creates the context before it returns. InvalidArgument for a device that cannot be parsed,
  // NotFound for a named one that cannot be had, Unavailable where there is none at all.
  static absl::StatusOr<std::unique_ptr<RenderThread>> Start(const RenderThreadOptions& options);

  // Finishes what was accepted, then stops the thread.
  ~RenderThread() override;
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;

  absl::Status Submit(FrameRequest request, std::stop_token stop, Done done) override;
  [[nodiscard]] const DeviceInfo& device() const override { return device_; }

 private:
  struct Job {
    FrameRequest request;
    std::stop_token stop;
    Done done;
  };

  explicit RenderThread(int max_queued_frames) : max_queued_frames_(max_queued_frames) {}
  void Run(const std::string& device);
  // Waits for a job; false when stopping and none is left.
  bool NextJob(Job& job);

  const int max_queued_frames_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;   // guarded by mutex_
  int unfinished_ = 0;     // guarded by mutex_: waiting or rendering
  bool stopping_ = false;  // guarded by mutex_
  bool started_ = false;   // guarded by mutex_, as are the next two until it is true
  absl::Status start_status_;
  DeviceInfo device_;
  std::thread thread_;
};

}  // namespace halflight
