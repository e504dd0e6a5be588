#include "server/frame_pipeline.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "halflight/sha256.h"
#include "server/convert/describe.h"
#include "server/frame_log.h"
#include "server/retry_hint.h"
#include "server/status_text.h"

namespace halflight {
namespace {

using Clock = std::chrono::steady_clock;

double Milliseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

double QueueMilliseconds(const FrameResult& result) {
  double waited = 0.0;
  for (const StageTiming& timing : result.timings) {
    waited += timing.stage == "queue" ? timing.milliseconds : 0.0;
  }
  return waited;
}

}  // namespace

// Everything that flows between the stages of one frame. Each stage writes its own part; the last
// output to be encoded sees all of it through `outputs_left`.
struct FramePipeline::Flight {
  FrameJob job;
  std::stop_token stop;
  Done done;
  Clock::time_point submitted;

  absl::Status outcome;  // of the stages before, or of the first output that failed, under `mutex`
  FrameResult rendered;  // its images: those of the request, then the error's
  FrameResult compared;  // without scattering, where the returned frame has it
  Clock::time_point compared_submitted;
  double comparison_ms = 0.0;  // rendering it
  std::optional<ErrorEstimate> error;

  Clock::time_point encode_begin;
  std::mutex mutex;
  std::atomic<size_t> outputs_left = 0;
  std::vector<EncodedImage> encoded;
  std::vector<std::string> digests;
};

FramePipeline::FramePipeline(FrameEngine& engine, PipelineOptions options)
    : engine_(engine), options_(std::move(options)), workers_(options_.encode_threads) {}

FramePipeline::~FramePipeline() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return flights_ == 0; });
}

absl::Status FramePipeline::Admit() {
  const std::lock_guard lock(mutex_);
  if (queued_ >= options_.max_queued_frames) {
    return BusyError(fmt::format("the queue is full ({} frames): retry later", queued_));
  }
  ++queued_;
  ++flights_;
  return absl::OkStatus();
}

absl::Status FramePipeline::Submit(FrameJob job, std::stop_token stop, Done done) {
  if (absl::Status status = Admit(); !status.ok()) {
    return status;
  }
  if (job.request_id.empty()) {
    const std::lock_guard lock(mutex_);
    job.request_id = fmt::format("server-{}", next_id_++);
  }
  auto flight = std::make_shared<Flight>();
  flight->job = std::move(job);
  flight->stop = std::move(stop);
  flight->done = std::move(done);
  flight->submitted = Clock::now();
  // The scene is needed again when the frame is described.
  absl::Status status = Render(flight, flight->job.request, &FramePipeline::OnRendered);
  if (!status.ok()) {
    const std::lock_guard lock(mutex_);
    --queued_;
    --flights_;
    idle_.notify_all();
  }
  return status;
}

absl::Status FramePipeline::Render(const FlightPtr& flight, FrameRequest request, Stage next) {
  const size_t images = request.images.size();
  const absl::Status status = engine_.Submit(
      std::move(request), flight->stop,
      // Only hand-overs from here: the engine's thread is for rendering.
      [this, flight, images, next](absl::StatusOr<FrameResult> result) {
        if (!result.ok()) {
          Fail(flight, result.status());
        } else if (result->images.size() != images) {
          Fail(flight, absl::InternalError(fmt::format("the renderer made {} images of {}",
                                                       result->images.size(), images)));
        } else {
          (this->*next)(flight, *std::move(result));
        }
      });
  return absl::IsResourceExhausted(status) ? WithRetryHint(status) : status;
}

void FramePipeline::OnRendered(const FlightPtr& flight, FrameResult result) {
  flight->rendered = std::move(result);
  const std::optional<MeasureJob>& measure = flight->job.measure;
  if (!measure.has_value()) {
    Encode(flight);
    return;
  }
  if (measure->without_scattering) {
    flight->compared_submitted = Clock::now();
    const absl::Status status =
        Render(flight, WithoutScattering(flight->job.request), &FramePipeline::OnRenderedToCompare);
    if (!status.ok()) {
      Fail(flight, status);
    }
    return;
  }
  measurer_.Post(
      [this, flight] { Measure(flight, flight->rendered.images[flight->job.measure->beauty]); });
}

void FramePipeline::OnRenderedToCompare(const FlightPtr& flight, FrameResult result) {
  flight->comparison_ms =
      Milliseconds(Clock::now() - flight->compared_submitted) - QueueMilliseconds(result);
  flight->compared = std::move(result);
  measurer_.Post([this, flight] { Measure(flight, flight->compared.images[0]); });
}

void FramePipeline::Measure(const FlightPtr& flight, const Image& beauty) {
  absl::StatusOr<FrameError> error = absl::CancelledError("the call was cancelled");
  if (!flight->stop.stop_requested()) {
    error = options_.measure(beauty, flight->job.request.scene, *flight->job.measure, flight->stop);
  }
  if (!error.ok()) {
    Fail(flight, Prefixed("measuring the error: ", error.status()));
    return;
  }
  error->estimate.milliseconds += flight->comparison_ms;
  flight->rendered.timings.push_back({"error", error->estimate.milliseconds});
  if (error->map.has_value()) {
    flight->rendered.images.push_back(*std::move(error->map));
  }
  flight->error = std::move(error->estimate);
  flight->compared = {};
  Encode(flight);
}

void FramePipeline::Encode(const FlightPtr& flight) {
  flight->encode_begin = Clock::now();
  const size_t outputs = flight->job.outputs.size();
  flight->encoded.resize(outputs);
  flight->digests.resize(outputs);
  flight->outputs_left = outputs;
  for (size_t i = 0; i < outputs; ++i) {
    workers_.Post([this, flight, i] { EncodeOutput(flight, i); });
  }
}

void FramePipeline::EncodeOutput(const FlightPtr& flight, size_t index) {
  const OutputJob& output = flight->job.outputs[index];
  absl::StatusOr<EncodedImage> encoded = absl::CancelledError("the call was cancelled");
  if (!flight->stop.stop_requested()) {
    encoded = options_.encode(flight->rendered.images[output.image], output.shown.kind,
                              output.shown.quantity, output.encoding,
                              DescribeImage(flight->job, flight->rendered, flight->error, output,
                                            engine_.device(), options_.server_version));
  }
  if (encoded.ok()) {
    flight->digests[index] = Sha256Of(encoded->bytes);
    flight->encoded[index] = *std::move(encoded);
  } else {
    const std::lock_guard lock(flight->mutex);
    if (flight->outcome.ok()) {
      flight->outcome = Prefixed(fmt::format("outputs[{}]: ", index), encoded.status());
    }
  }
  if (--flight->outputs_left == 0) {
    Complete(flight);
  }
}

void FramePipeline::Complete(const FlightPtr& flight) {
  const auto now = Clock::now();
  std::vector<StageTiming> timings;
  if (flight->outcome.ok()) {
    timings = std::move(flight->rendered.timings);
    timings.push_back({"encode", Milliseconds(now - flight->encode_begin)});
  }
  timings.push_back({"total", Milliseconds(now - flight->submitted)});

  absl::StatusOr<std::shared_ptr<const EncodedFrame>> answer = nullptr;
  if (flight->outcome.ok()) {
    auto frame = std::make_shared<EncodedFrame>();
    frame->header = DescribeFrame(flight->job, flight->rendered, flight->error, flight->encoded,
                                  timings, engine_.device(), options_.server_version);
    for (size_t i = 0; i < flight->encoded.size(); ++i) {
      frame->outputs.push_back(std::move(flight->encoded[i].bytes));
      frame->trailer.add_output_sha256(flight->digests[i]);
    }
    answer = std::shared_ptr<const EncodedFrame>(std::move(frame));
  } else {
    answer = flight->outcome;
  }
  // Pixels go before the answer does: a slow reader shall hold the encoded bytes only.
  flight->rendered = {};
  flight->compared = {};
  spdlog::info(FrameLogLine(flight->job, timings, flight->error, flight->outcome));
  {
    const std::lock_guard lock(mutex_);
    --queued_;
  }
  std::exchange(flight->done, nullptr)(std::move(answer));
  const std::lock_guard lock(mutex_);
  --flights_;
  idle_.notify_all();
}

void FramePipeline::Fail(const FlightPtr& flight, absl::Status status) {
  flight->outcome = std::move(status);
  workers_.Post([this, flight] { Complete(flight); });
}

}  // namespace halflight
