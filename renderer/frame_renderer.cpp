#include "renderer/frame_renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <new>
#include <thread>
#include <utility>

#include "renderer/frame_images.h"
#include "renderer/gl/debug.h"
#include "renderer/particle_view.h"
#include "renderer/readback.h"

namespace halflight {

namespace {

// How soon a frame that waits for the device notices that it was cancelled.
constexpr std::chrono::milliseconds kPatience(1);

// Passes whose work an earlier frame left are not run.
void MarkReused(const std::vector<PlannedPass>& reused, FramePlan& plan) {
  for (PlannedPass& pass : plan.passes) {
    if (std::find(reused.begin(), reused.end(), pass) == reused.end()) continue;
    pass.reason += ": kept from an earlier frame";
    pass.count = 0;
  }
}

}  // namespace

FrameRenderer::FrameRenderer(std::unique_ptr<gl::EglContext> context,
                             const FrameRendererOptions& options)
    : context_(std::move(context)),
      device_(context_->device()),
      cache_(options.max_reuse_bytes),
      pieces_(device_.software),
      faults_(options.faults) {
  device_.max_texture_size = std::min(device_.max_texture_size, options.max_texture_size);
  const int by_device = device_.software ? 1 : 2;
  frames_in_flight_ =
      static_cast<size_t>(options.frames_in_flight > 0 ? options.frames_in_flight : by_device);
}

absl::StatusOr<std::unique_ptr<FrameRenderer>> FrameRenderer::Create(
    const std::string& device, const FrameRendererOptions& options) {
  absl::StatusOr<std::unique_ptr<gl::EglContext>> context = gl::EglContext::Create(device);
  if (!context.ok()) return context.status();
  return std::unique_ptr<FrameRenderer>(new FrameRenderer(*std::move(context), options));
}

absl::StatusOr<FrameResult> FrameRenderer::Render(const FrameRequest& request,
                                                  const std::stop_token& stop) {
  absl::StatusOr<std::unique_ptr<Begun>> frame = Begin(request, stop);
  if (!frame.ok()) return frame.status();
  return Finish(*std::move(frame));
}

absl::StatusOr<std::unique_ptr<FrameRenderer::Begun>> FrameRenderer::Begin(FrameRequest request,
                                                                           std::stop_token stop) {
  auto frame = std::make_unique<Begun>();
  frame->request = std::move(request);
  // What the request leaves to the device.
  SliceCompositor& compositor = frame->request.scene.shadow.compositor;
  compositor = CompositorFor(compositor, device().software);
  frame->stop = std::move(stop);
  const absl::Status status = [&] {
    try {
      return Record(*frame);
    } catch (const std::bad_alloc&) {
      return absl::ResourceExhaustedError("there is not enough memory to render the frame");
    }
  }();
  // Whatever else went wrong comes of that.
  if (absl::Status reset = CheckReset(); !reset.ok()) return reset;
  if (!status.ok()) {
    // What it left behind is no other frame's.
    gl::ForgetErrors();
    return status;
  }
  return frame;
}

absl::Status FrameRenderer::CheckReset() {
  // The driver says so once.
  if (const GLenum status = glGetGraphicsResetStatus(); reset_.ok() && status != GL_NO_ERROR) {
    const bool suspect = status == GL_GUILTY_CONTEXT_RESET || status == GL_UNKNOWN_CONTEXT_RESET;
    reset_ = DeviceResetError(!suspect);
  }
  return reset_;
}

absl::StatusOr<DrawnFrame> FrameRenderer::Draw(const ShadowTechnique& technique,
                                               const DrawContext& context, Begun& frame) {
  switch (faults_ == nullptr ? DeviceFault::kNone : faults_->Next()) {
    case DeviceFault::kNone:
      break;
    case DeviceFault::kReset:
    case DeviceFault::kGone:
      reset_ = DeviceResetError(false);
      break;
    case DeviceFault::kInnocentReset:
      reset_ = DeviceResetError(true);
      break;
    case DeviceFault::kOutOfMemory: {
      // As a driver may say it: of the last thing that was asked for, when all others are there.
      absl::StatusOr<DrawnFrame> drawn = technique.Draw(context);
      if (!drawn.ok()) return drawn;
      return absl::ResourceExhaustedError("planned: the device is out of memory");
    }
    case DeviceFault::kHang:
      for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
    case DeviceFault::kLate: {
      absl::StatusOr<DrawnFrame> drawn = technique.Draw(context);
      frame.late_until = std::chrono::steady_clock::now() + kLateness;
      return drawn;
    }
  }
  return technique.Draw(context);
}

absl::Status FrameRenderer::Record(Begun& frame) {
  gl::ForgetErrors();
  frame.clock.BeginCpu("plan");
  const Scene& scene = frame.request.scene;
  cache_.ForgetGoneSets();
  FrameCache nothing_kept(0);
  FrameCache& cache = frame.request.reuse ? cache_ : nothing_kept;
  const auto particles =
      cache.FindOrMake(scene.particles, ParticleViewKeyOf(scene),
                       [&]() -> absl::StatusOr<ParticleView> { return ParticleView(scene); });
  if (!particles.ok()) return particles.status();
  frame.clamped_opacities = (*particles)->clamped_opacities();
  absl::StatusOr<FramePlan> plan = PlanFrame(frame.request, **particles);
  if (!plan.ok()) return plan.status();
  frame.plan = *std::move(plan);
  const DrawContext context{.gpu = gpu_,
                            .device = device(),
                            .cache = cache,
                            .pieces = pieces_,
                            .request = frame.request,
                            .particles = **particles,
                            .plan = frame.plan,
                            .clock = frame.clock,
                            .stop = frame.stop,
                            .staging = frames_in_flight_ > 1 ? &staging_ : nullptr};
  const ShadowTechnique& technique = TechniqueFor(scene.shadow.technique);
  absl::StatusOr<DrawnFrame> drawn = Draw(technique, context, frame);
  if (absl::IsResourceExhausted(drawn.status()) && (!cache_.empty() || frames_in_flight_ > 1)) {
    // What was kept may be what there is no room beside, or what frames in flight hold: until the
    // device is through with them, and with what they dropped.
    cache_.Clear();
    staging_.Clear();
    if (frames_in_flight_ > 1) glFinish();
    gl::ForgetErrors();
    drawn = Draw(technique, context, frame);
    if (absl::IsResourceExhausted(drawn.status())) cache_.Clear();
  }
  if (!drawn.ok()) return drawn.status();
  frame.drawn = *std::move(drawn);
  MarkReused(frame.drawn.reused, frame.plan);
  frame.clock.EndStage();
  if (frame.drawn.arriving != nullptr) frame.drawn.arriving->readback.Submit();
  return absl::OkStatus();
}

bool FrameRenderer::DrawsOnDevice(const FrameRequest& request) const {
  return TechniqueFor(request.scene.shadow.technique).DrawsOnDevice(request, device_);
}

bool FrameRenderer::CanFinish(const Begun& frame, std::chrono::nanoseconds wait) const {
  return frame.stop.stop_requested() || IsDrawn(frame, wait);
}

bool FrameRenderer::IsDrawn(const Begun& frame, std::chrono::nanoseconds wait) {
  if (std::chrono::steady_clock::now() < frame.late_until) {
    std::this_thread::sleep_for(wait);
    return false;
  }
  return frame.drawn.arriving == nullptr || frame.drawn.arriving->readback.Arrived(wait);
}

absl::StatusOr<FrameResult> FrameRenderer::Finish(std::unique_ptr<Begun> frame) {
  if (frame->drawn.arriving != nullptr) frame->clock.BeginCpu("readback");
  while (!CanFinish(*frame, kPatience)) {
  }
  if (absl::Status reset = CheckReset(); !reset.ok()) return reset;
  if (frame->stop.stop_requested()) {
    gl::ForgetErrors();
    return absl::CancelledError("frame cancelled");
  }
  FrameResult result;
  if (frame->drawn.arriving == nullptr) {
    result.images = std::move(frame->drawn.images);
  } else {
    ArrivingImages& arriving = *frame->drawn.arriving;
    arriving.readback.Deliver();
    if (absl::Status status = gl::CheckErrors("readback"); !status.ok()) return status;
    frame->clock.BeginCpu("images");
    result.images = SelectImages(frame->request, std::move(arriving.drawn));
  }
  result.plan = std::move(frame->plan);
  result.lights = std::move(frame->drawn.reports);
  result.clamped_opacities = frame->clamped_opacities;
  result.timings = frame->clock.Finish();
  return result;
}

}  // namespace halflight
