#include "tests/server/fake_engine.h"

#include <chrono>
#include <utility>

#include "halflight/particle_payload.h"
#include "renderer/light_buffer_size.h"

namespace halflight::testing {

FakeEngine::FakeEngine() : thread_([this] { Work(); }) {}

FakeEngine::~FakeEngine() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    open_ = true;
  }
  changed_.notify_all();
}

absl::Status FakeEngine::Submit(FrameRequest request, std::stop_token stop, Done done) {
  const std::lock_guard lock(mutex_);
  if (!refusal_.ok()) {
    return refusal_;
  }
  jobs_.push_back({std::move(request), std::move(stop), std::move(done)});
  changed_.notify_all();
  return absl::OkStatus();
}

void FakeEngine::SetGate(bool open) {
  const std::lock_guard lock(mutex_);
  open_ = open;
  changed_.notify_all();
}

void FakeEngine::FailWith(absl::Status status) {
  const std::lock_guard lock(mutex_);
  failure_ = std::move(status);
}

void FakeEngine::PretendMilliseconds(double milliseconds) {
  const std::lock_guard lock(mutex_);
  milliseconds_ = milliseconds;
}

void FakeEngine::RefuseWith(absl::Status status) {
  const std::lock_guard lock(mutex_);
  refusal_ = std::move(status);
}

int FakeEngine::rendered() const {
  const std::lock_guard lock(mutex_);
  return rendered_;
}

int FakeEngine::waiting() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(jobs_.size());
}

FrameRequest FakeEngine::last_request() const {
  const std::lock_guard lock(mutex_);
  return last_request_;
}

void FakeEngine::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    if (jobs_.empty()) {
      if (closing_) {
        return;
      }
      changed_.wait(lock);
      continue;
    }
    if (!open_ && !jobs_.front().stop.stop_requested()) {
      // Wakes by itself to see a cancellation.
      changed_.wait_for(lock, std::chrono::milliseconds(1));
      continue;
    }
    Job job = std::move(jobs_.front());
    jobs_.pop_front();
    absl::StatusOr<FrameResult> result = absl::CancelledError("stopped");
    if (!job.stop.stop_requested() && !failure_.ok()) {
      result = failure_;
    } else if (!job.stop.stop_requested()) {
      FrameResult frame;
      for (size_t i = 0; i < job.request.images.size(); ++i) {
        frame.images.push_back(FakeImage(job.request.scene, job.request.images[i], i));
      }
      const ShadowSettings& shadow = job.request.scene.shadow;
      frame.plan.light_buffer_size = LargestLightBufferSize(shadow, shadow.technique);
      frame.plan.passes.push_back({"pretend", "this is a test", 1});
      for (const Light& light : job.request.scene.lights) {
        frame.lights.push_back({.casts_shadows = light.casts_shadows(), .slices = 2});
      }
      frame.timings.push_back({"composite", milliseconds_});
      result = std::move(frame);
      ++rendered_;
      last_request_ = job.request;
    }
    lock.unlock();
    job.done(std::move(result));
    job = {};
    lock.lock();
  }
}

Image FakeImage(const Scene& scene, const ImageRequest& shown, size_t index) {
  Image image;
  const bool from_light =
      shown.kind == ImageKind::kLightBuffer || shown.kind == ImageKind::kLightLayers;
  const int texels = LargestLightBufferSize(scene.shadow, scene.shadow.technique);
  image.width = from_light ? texels : scene.camera.window.width;
  image.height = from_light ? texels : scene.camera.window.height;
  image.channels = {"Y"};
  if (shown.kind == ImageKind::kBeauty) {
    image.channels = {"R", "G", "B", "A"};
  }
  image.pixels.resize(static_cast<size_t>(image.width) * image.height * image.channels.size());
  for (size_t k = 0; k < image.pixels.size(); ++k) {
    image.pixels[k] = static_cast<float>(index) + static_cast<float>(k) / 1000.0F;
  }
  return image;
}

v1::RenderFrameRequest MakeRequest() {
  v1::RenderFrameRequest request;
  v1::Scene& scene = *request.mutable_scene();
  *scene.mutable_inline_particles() =
      MakeParticles(2, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS});
  v1::LookAt& look_at = *scene.mutable_camera()->mutable_look_at();
  look_at.mutable_eye()->set_z(10.0);
  look_at.mutable_target();
  scene.mutable_camera()->set_width(64);
  scene.mutable_camera()->set_height(48);
  v1::Light& light = *scene.mutable_lighting()->add_lights();
  light.mutable_directional()->mutable_direction()->set_y(-1.0);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_BEAUTY);
  return request;
}

FrameJob MustConvert(const v1::RenderFrameRequest& request, const ServerLimits& limits) {
  ParticleStore store(1 << 20);
  return *ConvertRequest(request, store, limits, {});
}

std::string BytesOf(const Image& image) {
  return {reinterpret_cast<const char*>(image.pixels.data()), image.pixels.size() * sizeof(float)};
}

absl::StatusOr<EncodedImage> EncodePlain(const SharedImage& image, ImageKind /*kind*/,
                                         LightQuantity /*quantity*/,
                                         const EncodeSettings& /*settings*/,
                                         const ImageMetadata& /*metadata*/) {
  return EncodedImage{
      .bytes = SharedBytes(BytesOf(*image)), .media_type = "test/plain", .white_black = {}};
}

}  // namespace halflight::testing
