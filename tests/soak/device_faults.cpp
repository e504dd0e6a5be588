// A device that is reset under load, under the same request each time, and one that hangs. Planned
// on a sound one.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/access/health.h"
#include "tests/process/wait_for.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

constexpr int kClients = 4;
constexpr uint64_t kBetweenResets = 40;  // drawings

std::vector<v1::RenderFrameRequest> RequestsOf(const client::EncodedParticles& particles) {
  return {FrameOf(particles.sha256, 64), SweepOf(particles.sha256, 96),
          FrameOf(particles.sha256, 160, 4)};
}

bool IsReset(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::UNAVAILABLE &&
         status.error_details().find("DEVICE_RESET") != std::string::npos;
}

// Resets that are nobody's fault, so that frames may be asked for again.
void ResetUnderLoad(Run& run, const client::EncodedParticles& particles) {
  const int resets = run.Of(50, 3);
  const testing::Folder folder;
  std::string plan;
  for (int i = 1; i <= resets; ++i) {
    plan += fmt::format("{}innocent-reset:{}", i > 1 ? "," : "", i * kBetweenResets);
  }
  std::vector<std::string> flags = {"--plan-device-faults", plan};
  if (run.sabotage) {
    flags.insert(flags.end(), {"--device", "forgets"});
  }
  const Server server(folder, flags, run.sabotage ? "halflightd_broken" : "halflightd");
  Upload(server.address(), particles);
  const std::vector<v1::RenderFrameRequest> requests = RequestsOf(particles);
  const auto channel = testing::NewChannel(server.address());
  std::vector<std::vector<std::string>> before;
  for (const v1::RenderFrameRequest& request : requests) {
    before.push_back(MustRender(channel, request));
  }
  const auto objects_before = server.Metric("halflight_gl_objects");

  std::atomic<int> seen = 0;
  std::atomic<int> drawn = 0;
  std::atomic<size_t> others = 0;
  std::atomic<size_t> otherwise = 0;
  std::vector<std::jthread> clients;
  for (int client = 0; client < kClients; ++client) {
    clients.emplace_back([&, client] {
      const auto own = testing::NewChannel(server.address());
      std::mt19937 random(static_cast<uint32_t>(client));
      const auto until = Clock::now() + std::chrono::minutes(5);
      // As many frames as bring all resets, and as many again.
      const auto most = static_cast<int>(2 * resets * kBetweenResets);
      while (seen < resets && drawn < most && Clock::now() < until) {
        const size_t which = random() % requests.size();
        CallOptions ask = Ask(requests[which]);
        ask.keep_frame = true;
        const auto call = Call::Start(own, ask);
        if (call->Wait().ok() && call->whole()) {
          ++drawn;
          others += call->frame().outputs == before[which] ? 0 : 1;
        } else if (IsReset(call->status())) {
          ++seen;
        } else {
          ++otherwise;
        }
      }
    });
  }
  clients.clear();
  for (size_t i = 0; i < requests.size(); ++i) {
    others += MustRender(channel, requests[i]) == before[i] ? 0 : 1;
  }
  const auto told = server.Metric("halflight_device_resets_total");
  Require(told.has_value(), "metrics that count resets");
  run.report.AtLeast("resets under load", *told, resets, "");
  run.report.AtMost("frames that ended with one, more than there were", seen - *told, 0, "");
  run.report.Tell("frames drawn meanwhile", drawn, "");
  run.report.None("frames that ended otherwise", otherwise);
  run.report.None("frames that are other bytes afterwards", others);
  const auto objects = server.Metric("halflight_gl_objects");
  Require(objects.has_value() && objects_before.has_value(), "metrics that count GL objects");
  run.report.AtMost("GL objects more after resets", *objects - *objects_before, 0, "");
}

void ResetByTheSameRequest(Run& run, const client::EncodedParticles& particles) {
  const testing::Folder folder;
  const Server server(folder,
                      {"--plan-device-faults", run.sabotage ? "innocent-reset:1-5" : "reset:1-5"});
  Upload(server.address(), particles);
  const std::vector<v1::RenderFrameRequest> requests = RequestsOf(particles);
  const auto channel = testing::NewChannel(server.address());
  size_t drawn = 0;
  size_t refused = 0;
  for (int i = 0; i < 5; ++i) {
    const auto call = Call::Start(channel, Ask(requests[0]));
    drawn += IsReset(call->Wait()) ? 1 : 0;
    refused += call->status().error_code() == grpc::StatusCode::FAILED_PRECONDITION ? 1 : 0;
  }
  run.report.AtMost("times that a request which resets the device was drawn",
                    static_cast<double>(drawn), 2, "");
  run.report.AtLeast("times that it was refused", static_cast<double>(refused), 3, "");
}

void Hang(Run& run, const client::EncodedParticles& particles) {
  const testing::Folder folder;
  Server server(folder, {"--plan-device-faults", "hang:3", "--max-frame-seconds", "1",
                         "--watchdog-seconds", run.sabotage ? "0" : "1"});
  Upload(server.address(), particles);
  const v1::RenderFrameRequest request = FrameOf(particles.sha256, 64);
  const auto channel = testing::NewChannel(server.address());
  MustRender(channel, request);
  MustRender(channel, request);
  const auto begin = Clock::now();
  const auto hung = Call::Start(channel, Ask(request));
  const bool told = testing::WaitFor([&] { return testing::Health(channel) != testing::kServing; },
                                     std::chrono::seconds(10));
  const bool not_serving = testing::Health(channel) == testing::kNotServing;
  if (!told) {
    server.Signal(SIGKILL);
  }
  const int code = server.Wait();
  const std::chrono::duration<double> took = Clock::now() - begin;
  run.report.Holds("health says NOT_SERVING of a device that hangs", told && not_serving);
  run.report.Holds("and the server ends with exit code 4", code == 4, fmt::format("{}", code));
  run.report.TimeAtMost("after at most (1 s a frame, 1 s of patience)", took.count(), 6, " s");
  hung->Cancel();
  hung->Wait();
}

}  // namespace

void RunDeviceFaults(Run& run) {
  const client::EncodedParticles particles = BallOf(2000);
  ResetUnderLoad(run, particles);
  ResetByTheSameRequest(run, particles);
  Hang(run, particles);
}

}  // namespace halflight::soak
