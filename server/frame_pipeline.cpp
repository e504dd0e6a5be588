#include "server/frame_pipeline.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "renderer/device_fault.h"
#include "server/convert/describe.h"
#include "server/error_detail.h"
#include "server/frame_log.h"
#include "server/log/log.h"
#include "server/request_id.h"
#include "server/status_text.h"
#include "server/time_limit.h"

namespace halflight {
namespace {

using Clock = std::chrono::steady_clock;

double Milliseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

absl::Status FromEngine(const absl::Status& status) {
  if (absl::IsResourceExhausted(status)) {
    // There may be memory when other frames have gone.
    return WithRetryHint(WithReason(status, v1::ERROR_REASON_DEVICE_MEMORY_FULL));
  }
  // Fields of what the renderer draws are the scene's; of what it is to show, the request's.
  const std::string field = DetailOf(status).field;
  if (!field.empty() && field != "outputs") {
    return Within("scene.", status);
  }
  if (IsDeviceReset(status)) {
    return WithRetryHint(WithReason(status, v1::ERROR_REASON_DEVICE_RESET));
  }
  if (absl::IsUnavailable(status)) {
    return WithReason(status, v1::ERROR_REASON_DRAINING);  // the engine has come to its end
  }
  return status;
}

absl::Status CallCancelled() { return absl::CancelledError("the call was cancelled"); }

double QueueMilliseconds(const FrameResult& result) {
  double waited = 0.0;
  for (const StageTiming& timing : result.timings) {
    waited += timing.stage == "queue" ? timing.milliseconds : 0.0;
  }
  return waited;
}

PinnedSet SetOf(const FrameJob& job) {
  const auto& set = job.request.scene.particles;
  return {set.get(), MemoryBytes(*set)};
}

}  // namespace

// Everything that flows between the stages of one frame. Each stage writes its own part; the last
// output to be encoded sees all of it through `outputs_left`.
struct FramePipeline::Flight {
  FrameJob job;
  std::stop_source stop;
  // Passes the client's wish on.
  std::optional<std::stop_callback<std::function<void()>>> on_client_stop;
  Done done;
  Clock::time_point submitted;
  std::shared_ptr<FrameAdmission::Memory> memory;

  std::atomic<bool> rendering_begun = false;
  std::optional<TimeLimit> time_limit;
  std::atomic<bool> took_too_long = false;

  absl::Status outcome;  // of the stages before, or of the first output that failed, under `mutex`
  std::optional<FrameSearch> search;  // while it goes on
  std::optional<MeasureJob> measure;  // of this pass over the frame
  MadeFrame frame;
  Clock::time_point compared_submitted;

  Clock::time_point encode_begin;
  std::mutex mutex;  // of what outputs do at once, to `outcome` and `time_limit`
  std::atomic<size_t> outputs_left = 0;
  std::vector<SharedImage> images;  // the frame's, whose own have their shapes only from then on
  std::vector<EncodedImage> encoded;
};

FramePipeline::FramePipeline(FrameEngine& engine, PipelineOptions options)
    : engine_(engine),
      options_(std::move(options)),
      admission_(options_.admission),
      encoders_(options_.encode_threads),
      queue_(engine, engine.frames_in_flight()) {
  if (options_.warm_up) {
    encoders_.Post({.run = [this] { WarmUp(); }});
  }
}

FramePipeline::~FramePipeline() { admission_.WaitUntilIdle(); }

void FramePipeline::WarmUp() {
  const auto image = std::make_shared<const Image>(
      Image{16, 16, 1, {"R", "G", "B", "A"}, std::vector<float>(size_t{16} * 16 * 4, 0.5F)});
  for (const ImageFormat format : {ImageFormat::kPng8, ImageFormat::kExrHalf}) {
    // A frame that needs the format says what is wrong with it.
    options_.encode(image, ImageKind::kBeauty, {}, {format}, {}).IgnoreError();
  }
}

absl::Status FramePipeline::Submit(FrameJob job, std::stop_token stop, Done done) {
  auto memory = admission_.Admit(job.caller.client(), job.pixel_bytes, SetOf(job));
  if (!memory.ok()) {
    return memory.status();
  }
  auto flight = std::make_shared<Flight>();
  flight->memory = *std::move(memory);
  if (job.request_id.empty()) {
    job.request_id = MakeRequestId();
  }
  flight->job = std::move(job);
  Log(LogLevel::kDebug, "frame_accepted", {{"request_id", flight->job.request_id}});
  flight->done = std::move(done);
  flight->submitted = Clock::now();
  flight->time_limit.emplace(timer_, options_.max_frame_time, [weak = std::weak_ptr(flight)] {
    if (const FlightPtr late = weak.lock()) {
      late->took_too_long = true;
      late->stop.request_stop();
    }
  });
  flight->on_client_stop.emplace(std::move(stop), [source = flight->stop] {
    // The callback, and its source, may go with the flight meanwhile.
    // NOLINTNEXTLINE(performance-unnecessary-copy-initialization)
    const std::stop_source kept = source;
    kept.request_stop();
  });
  if (flight->job.target.has_value()) {
    // Whichever thread lets it begin has work of its own.
    flight->job.target->knowledge->Enter(
        [this, flight] { short_work_.Post([this, flight] { BeginSearch(flight); }); });
    return absl::OkStatus();
  }
  flight->measure = flight->job.measure;
  // The scene is needed again when the frame is described.
  Render(flight, flight->job.request, &FramePipeline::OnRendered);
  return absl::OkStatus();
}

void FramePipeline::BeginSearch(const FlightPtr& flight) {
  flight->search.emplace(flight->job, costs_);
  NextPass(flight);
}

void FramePipeline::NextPass(const FlightPtr& flight) {
  if (flight->stop.stop_requested()) {
    Fail(flight, CallCancelled());
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
    Render(flight, flight->job.request, &FramePipeline::OnRendered);
  } else {
    AwaitMeasurement(flight);
  }
}

void FramePipeline::Render(const FlightPtr& flight, FrameRequest request, Stage next) {
  const size_t images = request.images.size();
  flight->time_limit->Pause();
  queue_.Push({.client = flight->job.caller.client(),
               .priority = flight->job.priority,
               .goes_on = flight->rendering_begun,
               .fingerprint = flight->job.fingerprint,
               .request = std::move(request),
               .stop = flight->stop.get_token(),
               .begun = [this, flight] { OnBegun(flight); },
               // Only hand-overs from here: the engine's thread is for rendering.
               .done =
                   [this, flight, images, next](absl::StatusOr<FrameResult> result) {
                     if (!result.ok()) {
                       Fail(flight, FromEngine(result.status()));
                     } else if (result->images.size() != images) {
                       Fail(flight,
                            absl::InternalError(fmt::format("the renderer made {} images of {}",
                                                            result->images.size(), images)));
                     } else {
                       (this->*next)(flight, *std::move(result));
                     }
                   }});
}

void FramePipeline::OnBegun(const FlightPtr& flight) {
  flight->rendering_begun = true;
  flight->time_limit->Run();
}

void FramePipeline::OnRendered(const FlightPtr& flight, FrameResult result) {
  flight->frame.rendered = std::move(result);
  // With a target also of a pass that is not measured: a map may be wanted of it yet.
  if (flight->job.measure.has_value() && flight->job.measure->without_scattering) {
    flight->compared_submitted = Clock::now();
    Render(flight, WithoutScattering(flight->job.request), &FramePipeline::OnRenderedToCompare);
  } else {
    OnCompared(flight);
  }
}

void FramePipeline::OnRenderedToCompare(const FlightPtr& flight, FrameResult result) {
  flight->frame.comparison_ms =
      Milliseconds(Clock::now() - flight->compared_submitted) - QueueMilliseconds(result);
  flight->frame.other = std::move(result.images[0]);
  OnCompared(flight);
}

void FramePipeline::OnCompared(const FlightPtr& flight) {
  if (flight->measure.has_value()) {
    AwaitMeasurement(flight);
  } else {
    OnMade(flight);
  }
}

void FramePipeline::AwaitMeasurement(const FlightPtr& flight) {
  flight->time_limit->Pause();
  measurer_.Post({.client = flight->job.caller.client(),
                  .priority = flight->job.priority,
                  .stop = flight->stop.get_token(),
                  .run = [this, flight] { Measure(flight); },
                  .cancelled = [this, flight] { Fail(flight, CallCancelled()); }});
}

void FramePipeline::Measure(const FlightPtr& flight) {
  flight->time_limit->Run();
  MadeFrame& frame = flight->frame;
  const MeasureJob& job = *flight->measure;
  absl::StatusOr<FrameError> error = CallCancelled();
  if (!flight->stop.stop_requested()) {
    const Image& beauty = job.without_scattering ? *frame.other : frame.rendered.images[job.beauty];
    error = options_.measure(beauty, flight->job.request.scene, job, flight->stop.get_token());
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
    short_work_.Post([this, flight] { NextPass(flight); });
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
  flight->time_limit->Pause();
  for (size_t i = 0; i < outputs; ++i) {
    encoders_.Post(
        {.client = flight->job.caller.client(),
         .priority = flight->job.priority,
         .stop = flight->stop.get_token(),
         .run = [this, flight, i] { EncodeOutput(flight, i); },
         .cancelled = [this, flight,
                       i] { short_work_.Post([this, flight, i] { EncodeOutput(flight, i); }); }});
  }
}

void FramePipeline::EncodeOutput(const FlightPtr& flight, size_t index) {
  const OutputJob& output = flight->job.outputs[index];
  absl::StatusOr<EncodedImage> encoded = CallCancelled();
  if (!flight->stop.stop_requested()) {
    {
      const std::lock_guard lock(flight->mutex);
      flight->time_limit->Run();
    }
    EncodeSettings settings = output.encoding;
    settings.stop = flight->stop.get_token();
    encoded = options_.encode(flight->images[output.image], output.shown.kind,
                              output.shown.quantity, settings,
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
  flight->on_client_stop.reset();
  flight->time_limit->Pause();
  if (flight->took_too_long && absl::IsCancelled(flight->outcome)) {
    flight->outcome =
        TooLongError("a frame that takes longer",
                     fmt::format("at most {} s",
                                 std::chrono::duration<double>(options_.max_frame_time).count()));
  }
  const auto now = Clock::now();
  if (!flight->outcome.ok()) {
    flight->frame = {};
  }
  std::vector<StageTiming>& timings = flight->frame.rendered.timings;
  if (flight->outcome.ok()) {
    timings.push_back({"encode", Milliseconds(now - flight->encode_begin)});
  }
  timings.push_back({"total", Milliseconds(now - flight->submitted)});
  Log(LogLevel::kInfo, "frame", FrameFields(flight->job, flight->frame, flight->outcome));
  options_.metrics->OnFrame(flight->job.caller.tenant, flight->job.request.scene.shadow.technique,
                            flight->outcome.code(), timings);

  absl::StatusOr<std::shared_ptr<const EncodedFrame>> answer = nullptr;
  if (flight->outcome.ok()) {
    auto frame = std::make_shared<EncodedFrame>();
    frame->header = DescribeFrame(flight->job, flight->frame, flight->encoded, engine_.device(),
                                  options_.server_version);
    uint64_t bytes = 0;
    for (EncodedImage& encoded : flight->encoded) {
      bytes += encoded.bytes.size();
      frame->outputs.push_back(std::move(encoded.bytes));
    }
    flight->memory->ShrinkTo(bytes);
    frame->accounted = flight->memory;
    answer = std::shared_ptr<const EncodedFrame>(std::move(frame));
  } else {
    answer = flight->outcome;
  }
  // Pixels go before the answer does: a slow reader shall hold the encoded bytes only, which are
  // the pixels where raw floats were asked for. So does the set, for which the next frame of a
  // sequence may wait.
  flight->frame = {};
  flight->images.clear();
  flight->memory.reset();
  admission_.OnEncoded(flight->job.caller.client(), SetOf(flight->job));
  flight->job.request.scene.particles.reset();
  std::exchange(flight->done, nullptr)(std::move(answer));
  admission_.OnEnded();
}

void FramePipeline::Fail(const FlightPtr& flight, absl::Status status) {
  flight->outcome = std::move(status);
  short_work_.Post([this, flight] { Complete(flight); });
}

}  // namespace halflight
