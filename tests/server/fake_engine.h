// A FrameEngine without GL for tests of the service: images of a known pattern, held back or failed
// on demand. Also complete requests to start from.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "halflight/v1/service.pb.h"
#include "renderer/frame_engine.h"
#include "server/convert/convert_frame.h"
#include "server/encode/encode.h"
#include "tests/server/made_particles.h"

namespace halflight::testing {

class FakeEngine : public FrameEngine {
 public:
  FakeEngine();
  // Finishes what was accepted, the gate open.
  ~FakeEngine() override;
  FakeEngine(const FakeEngine&) = delete;
  FakeEngine& operator=(const FakeEngine&) = delete;
  FakeEngine(FakeEngine&&) = delete;
  FakeEngine& operator=(FakeEngine&&) = delete;

  absl::Status Submit(FrameRequest request, std::stop_token stop, Done done) override;
  [[nodiscard]] const DeviceInfo& device() const override { return device_; }

  // While closed, frames wait unless they are cancelled.
  void SetGate(bool open);
  // What each frame comes to from now on; OK renders it.
  void FailWith(absl::Status status);
  // What frames are said to take from now on.
  void PretendMilliseconds(double milliseconds);
  // What Submit says from now on.
  void RefuseWith(absl::Status status);

  [[nodiscard]] int rendered() const;
  [[nodiscard]] int waiting() const;
  [[nodiscard]] FrameRequest last_request() const;

 private:
  struct Job {
    FrameRequest request;
    std::stop_token stop;
    Done done;
  };

  void Work();

  const DeviceInfo device_{.gl_renderer = "fake", .gl_version = "4.5 fake"};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool open_ = true;
  bool closing_ = false;
  int rendered_ = 0;
  double milliseconds_ = 0.25;
  absl::Status failure_;
  absl::Status refusal_;
  FrameRequest last_request_;
  std::jthread thread_;
};

// The images that the fake makes: their size is that of the window or light buffer, and pixel k of
// image i is i + k / 1000.
Image FakeImage(const Scene& scene, const ImageRequest& shown, size_t index);

// Two particles with a radius, a camera, one directional light with shadows, one beauty output.
v1::RenderFrameRequest MakeRequest();

// The request's job; ends the program, saying why, where the request is refused.
FrameJob MustConvert(const v1::RenderFrameRequest& request = MakeRequest(),
                     const ServerLimits& limits = {});

// Stands in for EncodeImage: the image's floats as they lie in memory.
// The pixels as they are.
std::string BytesOf(const Image& image);
absl::StatusOr<EncodedImage> EncodePlain(const SharedImage& image, ImageKind kind,
                                         LightQuantity quantity, const EncodeSettings& settings,
                                         const ImageMetadata& metadata);

}  // namespace halflight::testing
