// StartRenderThread for a halflightd that breaks its promises, to show that the soak notices.
// --device says how: "leaks" keeps something of each frame, more of one that was cancelled, and
// draws other pixels after such a one; "forgets" draws other pixels each time; "deaf" draws large
// frames for a second, whoever wants them to stop.

#include "renderer/render_thread.h"

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include <unistd.h>

#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

constexpr int kSmall = 256;  // pixels

class BrokenRenderThread : public FrameEngine {
 public:
  explicit BrokenRenderThread(std::string fault) : fault_(std::move(fault)) {}

  absl::Status Submit(FrameRequest request, std::stop_token stop, Done done) override {
    const bool large = request.scene.camera.window.width > kSmall;
    return engine_.Submit(
        std::move(request), stop,
        [this, stop, large, done = std::move(done)](absl::StatusOr<FrameResult> result) {
          // Long enough for some to be cancelled while they are drawn.
          std::this_thread::sleep_for(std::chrono::milliseconds(fault_ == "leaks" ? 12 : 3));
          if (fault_ == "deaf" && large) {
            std::this_thread::sleep_for(std::chrono::seconds(1));
          } else if (fault_ == "leaks") {
            Leak(stop.stop_requested());
          } else if (fault_ == "forgets") {
            ++change_;
          }
          if (result.ok()) {
            for (Image& image : result->images) {
              image.pixels[0] += static_cast<float>(change_);
            }
          }
          done(std::move(result));
        });
  }
  [[nodiscard]] const DeviceInfo& device() const override { return engine_.device(); }
  [[nodiscard]] EngineState state() const override {
    EngineState state = engine_.state();
    state.gl_objects += kept_objects_;
    return state;
  }

 private:
  // On the engine's thread.
  void Leak(bool cancelled) {
    constexpr size_t kBytes = size_t{1} << 20U;
    kept_.emplace_back(kBytes, 'x');
    if (cancelled) {
      ++change_;
      ++kept_objects_;
      kept_descriptors_.push_back(dup(STDERR_FILENO));
      kept_threads_.emplace_back([](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          std::this_thread::sleep_for(std::chrono::milliseconds(100));
        }
      });
    }
  }

  const std::string fault_;
  int change_ = 0;
  std::atomic<uint64_t> kept_objects_ = 0;
  std::vector<std::string> kept_;
  std::vector<int> kept_descriptors_;
  std::vector<std::jthread> kept_threads_;
  testing::FakeEngine engine_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameEngine>> StartRenderThread(const RenderThreadOptions& options) {
  return std::make_unique<BrokenRenderThread>(options.device);
}

}  // namespace halflight
