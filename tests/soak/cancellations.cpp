// Calls cancelled at random moments: nothing is left of them, and the next frame is what it was.

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/access/health.h"
#include "tests/process/wait_for.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

// More callers than the renderer serves: most calls wait when they are cancelled.
constexpr int kCallers = 12;

struct Moments {
  std::atomic<int> cancelled = 0;
  std::atomic<int> while_sent = 0;  // of these: after the header had come
  std::atomic<int> too_late = 0;    // answered before
  std::atomic<int> otherwise = 0;   // neither a frame nor CANCELLED
};

// Until `count` calls were cancelled.
void CancelMany(const std::vector<std::shared_ptr<grpc::Channel>>& channels,
                const std::vector<v1::RenderFrameRequest>& requests, int count, uint32_t seed,
                Moments& moments) {
  std::vector<std::jthread> callers;
  for (int caller = 0; caller < kCallers; ++caller) {
    callers.emplace_back([&, caller] {
      std::mt19937 random(seed + static_cast<uint32_t>(caller));
      // From before the server knows of the call until long after a frame was sent, as many in each
      // part of a scale that doubles.
      std::uniform_real_distribution<double> exponent(std::log(2e-5), std::log(0.3));
      while (moments.cancelled < count) {
        // Half of them are not read: they are cancelled while they are sent, if not before.
        const auto call = Call::Start(
            channels[random() % channels.size()],
            {.messages = {Bytes(requests[random() % requests.size()].SerializeAsString())},
             .read_at_most = random() % 2 == 0 ? 1 : std::numeric_limits<int>::max()});
        std::this_thread::sleep_for(std::chrono::duration<double>(std::exp(exponent(random))));
        call->Cancel();
        const grpc::Status& status = call->Wait();
        if (status.error_code() == grpc::StatusCode::CANCELLED) {
          ++moments.cancelled;
          moments.while_sent += call->messages() > 0 ? 1 : 0;
        } else if (status.ok()) {
          ++moments.too_late;
        } else {
          ++moments.otherwise;
        }
      }
    });
  }
}

// Frames that had been accepted and ended CANCELLED: those have their sizes in the log.
size_t CancelledFrames(const std::string& log) {
  size_t count = 0;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    const bool accepted = line.find(" frame request_id=") != std::string::npos &&
                          line.find(" size=") != std::string::npos;
    count += accepted && line.find("outcome=CANCELLED") != std::string::npos ? 1 : 0;
  }
  return count;
}

struct Holdings {
  double descriptors = 0.0;
  double threads = 0.0;
  double megabytes = 0.0;
  std::optional<double> gl_objects;
};

Holdings HoldingsOf(const Server& server) {
  return {.descriptors = static_cast<double>(server.Count("fd")),
          .threads = static_cast<double>(server.Count("task")),
          .megabytes = server.Megabytes(),
          .gl_objects = server.Metric("halflight_gl_objects")};
}

}  // namespace

void RunCancellations(Run& run) {
  const testing::Folder folder;
  std::vector<std::string> flags = {"--max-queued-frames", "64", "--max-client-frames", "64"};
  if (run.sabotage) {
    flags.insert(flags.end(), {"--device", "leaks"});
  }
  const Server server(folder, flags, run.sabotage ? "halflightd_broken" : "halflightd");
  const client::EncodedParticles particles = BallOf(3000);
  Upload(server.address(), particles);
  std::vector<std::shared_ptr<grpc::Channel>> channels;
  for (int i = 0; i < 4; ++i) {
    channels.push_back(testing::NewChannel(server.address()));
  }
  // The last one is sent in several chunks.
  const std::vector<v1::RenderFrameRequest> requests = {
      FrameOf(particles.sha256, 64), SweepOf(particles.sha256, 96),
      FrameOf(particles.sha256, 160, 4), SweepOf(particles.sha256, 256)};

  Moments warm;
  CancelMany(channels, requests, run.Of(1000, 60), 1, warm);
  std::vector<std::vector<std::string>> frames;
  for (const v1::RenderFrameRequest& request : requests) {
    frames.push_back(MustRender(channels[0], request));
  }
  if (!run.short_form) {
    server.Rest();
  }
  const Holdings before = HoldingsOf(server);

  Moments moments;
  CancelMany(channels, requests, run.Of(10000, 250), 1000, moments);
  size_t others = 0;
  for (size_t i = 0; i < requests.size(); ++i) {
    others += MustRender(channels[0], requests[i]) == frames[i] ? 0 : 1;
  }
  // What ends a call comes back to its client before the server has put all of it away.
  testing::WaitFor([&] { return server.Count("fd") <= before.descriptors; },
                   std::chrono::seconds(5));
  if (!run.short_form) {
    server.Rest();
  }
  const Holdings after = HoldingsOf(server);
  const std::string log = server.Err();

  run.report.AtLeast("calls cancelled", moments.cancelled, run.Of(10000, 250), "");
  run.report.Tell("of these while being sent", moments.while_sent, "");
  run.report.Tell("of these after the server had accepted the frame, before it was encoded",
                  static_cast<double>(CancelledFrames(log)), "");
  run.report.Tell("answered before they were cancelled", moments.too_late, "");
  run.report.None("ended neither with a frame nor CANCELLED", moments.otherwise);
  run.report.AtMost("descriptors more", after.descriptors - before.descriptors, 0, "");
  // gRPC's own come and go while it is busy; the long form lets it rest.
  run.report.AtMost("threads more", after.threads - before.threads, run.Of(0, 4), "");
  Require(after.gl_objects.has_value() && before.gl_objects.has_value(),
          "metrics that count GL objects");
  run.report.AtMost("GL objects more", *after.gl_objects - *before.gl_objects, 0, "");
  run.report.TimeAtMost("memory more", after.megabytes - before.megabytes, 4, " MiB");
  run.report.None("frames that are other bytes afterwards", others);
}

}  // namespace halflight::soak
