#include "server/frame_pipeline.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/convert/describe.h"
#include "server/convert/field_checks.h"
#include "server/frame_log.h"
#include "server/retry_hint.h"
#include "server/status_text.h"

namespace halflight {
namespace {

using Clock = std::chrono::steady_clock;

// How soon a frame that was accepted asks again, where the engine had no room for it. Short against
// the time of a frame.
constexpr auto kAskAgain = std::chrono::milliseconds(5);

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
  std::optional<FrameSearch> search;  // while it goes on
  std::optional<MeasureJob> measure;  // of this pass over the frame
  MadeFrame frame;
  Clock::time_point compared_submitted;

  Clock::time_point encode_begin;
  std::mutex mutex;
  std::atomic<size_t> outputs_left = 0;
  std::vector<SharedImage> images;  // the frame's, whose own have their shapes only from then on
  std::vector<EncodedImage> encoded;
};

FramePipeline::FramePipeline(FrameEngine& engine, PipelineOptions options)
    : engine_(engine), options_(std::move(options)), workers_(options_.encode_threads) {
  if (options_.warm_up) {
    workers_.Post([this] { WarmUp(); });
  }
}

FramePipeline::~FramePipeline() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return flights_ == 0; });
}

void FramePipeline::WarmUp() {
  const auto image = std::make_shared<const Image>(
      Image{16, 16, 1, {"R", "G", "B", "A"}, std::vector<float>(size_t{16} * 16 * 4, 0.5F)});
  for (const ImageFormat format : {ImageFormat::kPng8, ImageFormat::kExrHalf}) {
    // A frame that needs the format says what is wrong with it.
    options_.encode(image, ImageKind::kBeauty, {}, {format}, {}).IgnoreError();
  }
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
  if (flight->job.target.has_value()) {
    // Whichever thread lets it begin has work of its own.
    flight->job.target->knowledge->Enter(
        [this, flight] { workers_.Post([this, flight] { BeginSearch(flight); }); });
    return absl::OkStatus();
  }
  flight->measure = flight->job.measure;
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

void FramePipeline::BeginSearch(const FlightPtr& flight) {
  flight->search.emplace(flight->job, costs_);
  NextPass(flight);
}

void FramePipeline::NextPass(const FlightPtr& flight) {
  if (flight->stop.stop_requested()) {
    Fail(flight, absl::CancelledError("the call was cancelled"));
    return;
  }
  const std::optional<FramePass> pass = flight->search->Next(flight->frame);
  Scene& scene = flight->job.request.scene;
  if (!pass.has_value()) {
    const TargetOutcome& target = *flight->frame.target;
    if (!target.returned.has_value()) {
      Fail(flight, FieldError("target", "a scene that no technique can draw", target.reason));
      return;
    }
    const Settings& settings = target.attempts[*target.returned].settings;
    scene.shadow = settings.shadow;
    scene.sampling = settings.sampling;
    flight->search.reset();
    Encode(flight);
    return;
  }
  flight->measure = pass->measure;
  if (pass->settings.has_value()) {
    scene.shadow = pass->settings->shadow;
    scene.sampling = pass->settings->sampling;
    RenderWhenThereIsRoom(flight, flight->job.request, &FramePipeline::OnRendered);
  } else {
    measurer_.Post([this, flight] { Measure(flight); });
  }
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

// For frames that were accepted: they are not lost because the queue is full when they come back.
void FramePipeline::RenderWhenThereIsRoom(const FlightPtr& flight, FrameRequest request,
                                          Stage next) {
  const absl::Status status = Render(flight, request, next);
  if (status.ok()) {
    return;
  }
  if (!absl::IsResourceExhausted(status)) {
    Fail(flight, status);
  } else if (flight->stop.stop_requested()) {
    Fail(flight, absl::CancelledError("the call was cancelled"));
  } else {
    waiter_.Post([this, flight, request = std::move(request), next] {
      std::this_thread::sleep_for(kAskAgain);
      RenderWhenThereIsRoom(flight, request, next);
    });
  }
}

void FramePipeline::OnRendered(const FlightPtr& flight, FrameResult result) {
  flight->frame.rendered = std::move(result);
  if (!flight->measure.has_value()) {
    OnMade(flight);
  } else if (flight->measure->without_scattering) {
    flight->compared_submitted = Clock::now();
    RenderWhenThereIsRoom(flight, WithoutScattering(flight->job.request),
                          &FramePipeline::OnRenderedToCompare);
  } else {
    measurer_.Post([this, flight] { Measure(flight); });
  }
}

void FramePipeline::OnRenderedToCompare(const FlightPtr& flight, FrameResult result) {
  flight->frame.comparison_ms =
      Milliseconds(Clock::now() - flight->compared_submitted) - QueueMilliseconds(result);
  flight->frame.other = std::move(result.images[0]);
  measurer_.Post([this, flight] { Measure(flight); });
}

void FramePipeline::Measure(const FlightPtr& flight) {
  MadeFrame& frame = flight->frame;
  const MeasureJob& job = *flight->measure;
  absl::StatusOr<FrameError> error = absl::CancelledError("the call was cancelled");
  if (!flight->stop.stop_requested()) {
    const Image& beauty = job.without_scattering ? *frame.other : frame.rendered.images[job.beauty];
    error = options_.measure(beauty, flight->job.request.scene, job, flight->stop);
  }
  if (!error.ok()) {
    Fail(flight, Prefixed("measuring the error: ", error.status()));
    return;
  }
  frame.measurement_ms = error->estimate.milliseconds;
  error->estimate.milliseconds +=
      frame.error.has_value() ? frame.error->milliseconds : frame.comparison_ms;
  frame.error = std::move(error->estimate);
  if (error->map.has_value()) {
    frame.rendered.images.push_back(*std::move(error->map));
  }
  OnMade(flight);
}

void FramePipeline::OnMade(const FlightPtr& flight) {
  if (flight->search.has_value()) {
    workers_.Post([this, flight] { NextPass(flight); });
  } else {
    Encode(flight);
  }
}

void FramePipeline::Encode(const FlightPtr& flight) {
  MadeFrame& frame = flight->frame;
  frame.other.reset();
  if (frame.error.has_value()) {
    frame.rendered.timings.push_back({"error", frame.error->milliseconds});
  }
  flight->encode_begin = Clock::now();
  for (Image& image : frame.rendered.images) {
    std::vector<float> pixels = std::exchange(image.pixels, {});
    flight->images.push_back(std::make_shared<const Image>(
        Image{image.width, image.height, image.layers, image.channels, std::move(pixels)}));
  }
  const size_t outputs = flight->job.outputs.size();
  flight->encoded.resize(outputs);
  flight->outputs_left = outputs;
  for (size_t i = 0; i < outputs; ++i) {
    workers_.Post([this, flight, i] { EncodeOutput(flight, i); });
  }
}

void FramePipeline::EncodeOutput(const FlightPtr& flight, size_t index) {
  const OutputJob& output = flight->job.outputs[index];
  absl::StatusOr<EncodedImage> encoded = absl::CancelledError("the call was cancelled");
  if (!flight->stop.stop_requested()) {
    encoded = options_.encode(flight->images[output.image], output.shown.kind,
                              output.shown.quantity, output.encoding,
                              DescribeImage(flight->job, flight->frame, output, engine_.device(),
                                            options_.server_version));
  }
  if (encoded.ok()) {
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
  flight->search.reset();  // others may wait for it
  const auto now = Clock::now();
  if (!flight->outcome.ok()) {
    flight->frame = {};
  }
  std::vector<StageTiming>& timings = flight->frame.rendered.timings;
  if (flight->outcome.ok()) {
    timings.push_back({"encode", Milliseconds(now - flight->encode_begin)});
  }
  timings.push_back({"total", Milliseconds(now - flight->submitted)});
  spdlog::info(FrameLogLine(flight->job, flight->frame, flight->outcome));

  absl::StatusOr<std::shared_ptr<const EncodedFrame>> answer = nullptr;
  if (flight->outcome.ok()) {
    auto frame = std::make_shared<EncodedFrame>();
    frame->header = DescribeFrame(flight->job, flight->frame, flight->encoded, engine_.device(),
                                  options_.server_version);
    for (EncodedImage& encoded : flight->encoded) {
      frame->outputs.push_back(std::move(encoded.bytes));
    }
    answer = std::shared_ptr<const EncodedFrame>(std::move(frame));
  } else {
    answer = flight->outcome;
  }
  // Pixels go before the answer does: a slow reader shall hold the encoded bytes only, which are
  // the pixels where raw floats were asked for.
  flight->frame = {};
  flight->images.clear();
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
