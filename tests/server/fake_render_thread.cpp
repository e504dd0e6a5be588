// StartRenderThread for a halflightd without GL, under the real one's name. Frames wait for as long
// as the file that --device names is there; so does its start for one with ".start" added, which it
// renames to ".starting" then, and its end for one with ".end".

#include "renderer/render_thread.h"

#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>
#include <utility>

#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

void WaitWhileThere(const std::string& path) {
  while (std::filesystem::exists(path)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

class FakeRenderThread : public FrameEngine {
 public:
  explicit FakeRenderThread(std::string hold) : hold_(std::move(hold)) {}

  ~FakeRenderThread() override { WaitWhileThere(hold_ + ".end"); }
  FakeRenderThread(const FakeRenderThread&) = delete;
  FakeRenderThread& operator=(const FakeRenderThread&) = delete;

  absl::Status Submit(FrameRequest request, std::stop_token stop, Done done) override {
    return engine_.Submit(std::move(request), std::move(stop), std::move(done));
  }
  [[nodiscard]] const DeviceInfo& device() const override { return engine_.device(); }

 private:
  testing::FakeEngine engine_;
  const std::string hold_;
  std::jthread watcher_{[this](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      engine_.SetGate(!std::filesystem::exists(hold_));
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }};
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameEngine>> StartRenderThread(const RenderThreadOptions& options) {
  if (options.device == "missing") {
    return absl::NotFoundError("--device: missing, allowed: what is there");
  }
  const std::string start = options.device + ".start";
  if (std::filesystem::exists(start)) {
    std::filesystem::rename(start, start + "ing");
    WaitWhileThere(start + "ing");
  }
  return std::make_unique<FakeRenderThread>(options.device);
}

}  // namespace halflight
