// A frame's way through the server: rendered on the engine's thread, its error measured where that
// is asked for and its outputs encoded on others, and handed over complete. A frame with
// a target is rendered and measured as often as its search wants. Does not send anything and knows
// no clients.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "halflight/v1/frame.pb.h"
#include "renderer/frame_engine.h"
#include "server/convert/convert_frame.h"
#include "server/encode/encode.h"
#include "server/fair_workers.h"
#include "server/frame_admission.h"
#include "server/frame_measurement.h"
#include "server/frame_queue.h"
#include "server/frame_search.h"
#include "server/made_frame.h"
#include "server/metrics/metrics.h"
#include "server/timer.h"
#include "server/worker_pool.h"

namespace halflight {

// A finished frame as it is sent, but for the checksums in its trailer: they are made while
// sending.
struct EncodedFrame {
  v1::FrameHeader header;
  std::vector<SharedBytes> outputs;       // in the request's order
  std::shared_ptr<const void> accounted;  // of the memory that frames may take; given back with it
};

struct PipelineOptions {
  AdmissionLimits admission{};
  // From when a frame's rendering begins until it is encoded, without its waiting for another turn:
  // to be rendered again, or to be measured.
  std::chrono::milliseconds max_frame_time = std::chrono::milliseconds::max();
  int encode_threads = 1;
  // Whether to encode a small image of each kind of file at once, so that the first frame does not
  // wait for what the image library does the first time.
  bool warm_up = false;
  Metrics* metrics = &Metrics::None();
  std::string server_version = "unknown";
  // What makes bytes of pixels; any thread.
  std::function<absl::StatusOr<EncodedImage>(const SharedImage&, ImageKind, LightQuantity,
                                             const EncodeSettings&, const ImageMetadata&)>
      encode = EncodeImage;
  // What holds a beauty against the image model; one thread of the pipeline, one frame at a time.
  std::function<absl::StatusOr<FrameError>(const Image&, const Scene&, const MeasureJob&,
                                           const std::stop_token&)>
      measure = FrameMeasurer();
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

  // Queues a frame; makes a request_id where the job has none. One with a target begins when its
  // knowledge lets it. When it returns OK, `done` is called
  // exactly once, on a thread of the pipeline, never of the engine: with the frame, with an error,
  // or with Cancelled soon after `stop` was requested; DeadlineExceeded where the frame took too
  // long, Unavailable where the device failed under it, FailedPrecondition where it did so before.
  // Frames may be done in another order than they were submitted. Otherwise `done` is never called:
  // ResourceExhausted with reason and retry hint when too many frames are under way, or of this
  // client, or when they hold too much memory, of their own or of particle sets. Any thread.
  absl::Status Submit(FrameJob job, std::stop_token stop, Done done);

  // Whether Submit would find a place for a frame of this client now, its memory left aside: for
  // refusing what needs no looking into. Any thread.
  [[nodiscard]] absl::Status PlaceFor(const std::string& client) const {
    return admission_.PlaceFor(client);
  }
  // Frames accepted and not yet encoded. Any thread.
  [[nodiscard]] uint32_t queued() const { return admission_.queued(); }
  // Frames that wait for the engine. Any thread.
  [[nodiscard]] size_t waiting() const { return queue_.waiting(); }
  // Whether no frame is anywhere between Submit and the end of `done`. Any thread.
  [[nodiscard]] bool idle() const { return admission_.idle(); }
  // Frames that were ever accepted. Any thread.
  [[nodiscard]] uint64_t accepted() const { return admission_.accepted(); }
  // What frames hold until they are sent. Any thread.
  [[nodiscard]] uint64_t memory_bytes() const { return admission_.memory_bytes(); }

 private:
  struct Flight;
  using FlightPtr = std::shared_ptr<Flight>;
  using Stage = void (FramePipeline::*)(const FlightPtr& flight, FrameResult result);

  // The stages in their order. Each hands the flight on, or over to Fail, and touches it no more.
  void BeginSearch(const FlightPtr& flight);
  void NextPass(const FlightPtr& flight);
  void Render(const FlightPtr& flight, FrameRequest request, Stage next);
  void OnBegun(const FlightPtr& flight);
  void OnRendered(const FlightPtr& flight, FrameResult result);
  void OnRenderedToCompare(const FlightPtr& flight, FrameResult result);
  void OnCompared(const FlightPtr& flight);
  void AwaitMeasurement(const FlightPtr& flight);
  void Measure(const FlightPtr& flight);
  void OnMade(const FlightPtr& flight);
  void Encode(const FlightPtr& flight);
  void EncodeOutput(const FlightPtr& flight, size_t index);
  void Complete(const FlightPtr& flight);

  void Fail(const FlightPtr& flight, absl::Status status);
  void WarmUp();

  FrameEngine& engine_;
  const PipelineOptions options_;
  CostModel costs_;  // of the engine's device
  FrameAdmission admission_;
  // For what takes no time to speak of, so that it never waits behind what does. What posts to
  // another ends before it.
  WorkerPool short_work_{1};
  FairWorkers encoders_;
  // One thread: a measurement has all cores to itself, but for what renders and encodes meanwhile.
  FairWorkers measurer_{1};
  Timer timer_;
  FrameQueue queue_;
};

}  // namespace halflight
