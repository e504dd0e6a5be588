// A frame's way through the server: rendered on the engine's thread, its outputs encoded and hashed
// on others, and handed over complete. Does not send anything and knows no clients.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "halflight/v1/frame.pb.h"
#include "renderer/frame_engine.h"
#include "server/convert/convert_frame.h"
#include "server/encode/encode.h"
#include "server/worker_pool.h"

namespace halflight {

// A finished frame as it is sent.
struct EncodedFrame {
  v1::FrameHeader header;
  std::vector<std::string> outputs;  // bytes, in the request's order
  v1::FrameTrailer trailer;
};

struct PipelineOptions {
  uint32_t max_queued_frames = 64;  // accepted and not yet encoded
  int encode_threads = 1;
  std::string server_version = "unknown";
  // What makes bytes of pixels; any thread.
  std::function<absl::StatusOr<EncodedImage>(const Image&, ImageKind, LightQuantity,
                                             const EncodeSettings&, const ImageMetadata&)>
      encode = EncodeImage;
};

class FramePipeline {
 public:
  using Done = std::function<void(absl::StatusOr<std::shared_ptr<const EncodedFrame>>)>;

  // The engine outlives the pipeline.
  FramePipeline(FrameEngine& engine, PipelineOptions options);
  // Waits for every frame that was accepted.
  ~FramePipeline();
  FramePipeline(const FramePipeline&) = delete;
  FramePipeline& operator=(const FramePipeline&) = delete;
  FramePipeline(FramePipeline&&) = delete;
  FramePipeline& operator=(FramePipeline&&) = delete;

  // Queues a frame; makes a request_id where the job has none. When it returns OK, `done` is called
  // exactly once, on a thread of the pipeline, never of the engine: with the frame, with an error,
  // or with Cancelled soon after `stop` was requested. Frames may be done in another order than
  // they were submitted. Otherwise `done` is never called: ResourceExhausted with a retry hint when
  // too many frames are under way, Unavailable when the engine is shutting down. Any thread.
  absl::Status Submit(FrameJob job, std::stop_token stop, Done done);

 private:
  struct Flight;

  absl::Status Admit();
  void OnRendered(const std::shared_ptr<Flight>& flight, absl::StatusOr<FrameResult> result);
  void EncodeOutput(const std::shared_ptr<Flight>& flight, size_t index);
  void Complete(const std::shared_ptr<Flight>& flight);

  FrameEngine& engine_;
  const PipelineOptions options_;

  std::mutex mutex_;
  std::condition_variable idle_;
  uint32_t queued_ = 0;   // counts against the limit
  uint32_t flights_ = 0;  // until `done` has returned
  uint64_t next_id_ = 0;

  WorkerPool workers_;
};

}  // namespace halflight
