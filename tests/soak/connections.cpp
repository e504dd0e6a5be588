// A crowd of clients, half of whom do not read the frames that they asked for.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include <sys/resource.h>

#include "tests/access/health.h"
#include "tests/measure/timing.h"
#include "tests/process/wait_for.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

void RaiseOwnLimit() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

// Of one that takes no more than it reads: gRPC's own window grows with the speed of the line until
// all of a frame fits in, read or not.
std::shared_ptr<grpc::Channel> NarrowChannel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

// One that asks for a large frame, reads its header and then nothing for longer than the server
// waits. Where it is refused, for want of memory for frames, it asks again until it has had its
// frame.
class SlowReader {
 public:
  SlowReader(std::shared_ptr<grpc::Channel> channel, const v1::RenderFrameRequest& request,
             Clock::duration pause)
      : channel_(std::move(channel)), request_(Bytes(request.SerializeAsString())), pause_(pause) {
    Ask();
  }

  // Looks at the call; whether the reader has had its frame, whole or not.
  bool Look() {
    if (done_) {
      return true;
    }
    if (!call_->done()) {
      if (call_->messages() > 0 && !begun_.has_value()) {
        begun_ = Clock::now();
      }
      if (begun_.has_value() && !reads_on_ && Clock::now() - *begun_ > pause_) {
        reads_on_ = true;
        call_->ReadOn();
      }
      return false;
    }
    if (call_->messages() > 0) {
      done_ = true;
      aborted_ = call_->status().error_code() == grpc::StatusCode::CANCELLED;
    } else if (call_->status().error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) {
      done_ = true;
    } else if (Clock::now() - call_->ended() > milliseconds(500)) {
      ++refused_;
      Ask();
    }
    return done_;
  }
  [[nodiscard]] bool holds() const { return begun_.has_value() && !reads_on_; }
  [[nodiscard]] bool aborted() const { return aborted_; }
  [[nodiscard]] int refused() const { return refused_; }
  void Cancel() { call_->Cancel(); }
  void Wait() { call_->Wait(); }

 private:
  void Ask() { call_ = Call::Start(channel_, {.messages = {request_}, .read_at_most = 1}); }

  std::shared_ptr<grpc::Channel> channel_;
  grpc::ByteBuffer request_;
  Clock::duration pause_;
  std::shared_ptr<Call> call_;
  std::optional<Clock::time_point> begun_;
  bool reads_on_ = false;
  bool done_ = false;
  bool aborted_ = false;
  int refused_ = 0;
};

}  // namespace

void RunConnections(Run& run) {
  RaiseOwnLimit();
  // Sabotaged: as many as hold more than is allowed.
  const int clients = run.sabotage ? 160 : run.Of(1000, 60);
  const int slow = clients / 2;
  const int stall_seconds = run.Of(5, 1);
  const testing::Folder folder;
  // A frame of 4 MB: what all of them may hold is bounded, as anybody would who serves strangers.
  const Server server(
      folder, {"--max-stall-seconds", run.sabotage ? "0" : std::to_string(stall_seconds),
               "--max-output-bytes", "8MiB", "--max-frame-bytes", run.sabotage ? "4GiB" : "96MiB"});
  const client::EncodedParticles particles = BallOf(2000);
  Upload(server.address(), particles);
  const v1::RenderFrameRequest large = SweepOf(particles.sha256, 512);
  MustRender(testing::NewChannel(server.address()), large);
  const double memory_before = server.Megabytes();
  const double descriptors_before = static_cast<double>(server.Count("fd"));

  HealthProbe health(server.address());
  PeakMemory peak(server);
  std::vector<std::shared_ptr<grpc::Channel>> idle;
  std::vector<std::unique_ptr<SlowReader>> readers;
  int connected = 0;
  for (int i = 0; i < clients; ++i) {
    if (i % 2 == 0) {
      auto channel = testing::NewChannel(server.address());
      connected += testing::Health(channel) == testing::kServing ? 1 : 0;
      idle.push_back(std::move(channel));
    } else {
      readers.push_back(std::make_unique<SlowReader>(NarrowChannel(server.address()), large,
                                                     milliseconds(1000 * stall_seconds + 500)));
    }
  }
  if (run.sabotage) {
    server.Signal(SIGSTOP);
    std::this_thread::sleep_for(milliseconds(300));
    server.Signal(SIGCONT);
  }
  const auto begin = Clock::now();
  // What a stall, and the frames that are let in at a time, add up to; and as much again.
  const seconds patience(run.Of(240, 20));
  size_t most_at_once = 0;
  size_t done = 0;
  while (done < readers.size() && Clock::now() - begin < patience) {
    size_t holding = 0;
    done = 0;
    for (const auto& reader : readers) {
      done += reader->Look() ? 1 : 0;
      holding += reader->holds() ? 1 : 0;
    }
    most_at_once = std::max(most_at_once, holding);
    std::this_thread::sleep_for(milliseconds(20));
  }
  const std::chrono::duration<double> took = Clock::now() - begin;
  const double memory_peak = peak.Stop();
  const std::vector<double> waits = health.Stop();
  size_t aborted = 0;
  int refused = 0;
  for (const auto& reader : readers) {
    aborted += reader->aborted() ? 1 : 0;
    refused += reader->refused();
    reader->Cancel();
  }
  for (const auto& reader : readers) {
    reader->Wait();
  }
  const double open = server.Metric("halflight_connections").value_or(0.0);

  run.report.AtLeast("clients connected", connected + slow, clients, "");
  run.report.AtLeast("connections open at the server", open, clients, "");
  run.report.Tell("frames held unread at once, at most", static_cast<double>(most_at_once), "");
  run.report.Tell("refused until others were ended", refused, "");
  run.report.AtLeast("slow readers ended by the server after their frame began",
                     static_cast<double>(aborted), slow, "");
  run.report.Tell("all of them ended after", took.count(), " s");
  run.report.MemoryAtMost("memory more, at most", memory_peak - memory_before, 200);
  run.report.Tell("questions for health meanwhile", static_cast<double>(waits.size()), "");
  run.report.TimeAtMost("health answered within, 99.9th percentile",
                        measure::Quantile(waits, 0.999), 100, " ms");
  run.report.TimeAtMost("health answered within, longest", measure::Quantile(waits, 1.0), 100,
                        " ms");
  readers.clear();
  idle.clear();
  run.report.Holds(
      "connections closed when the clients are gone",
      testing::WaitFor([&] { return server.Count("fd") <= descriptors_before + 1; }, seconds(10)));
  if (!run.short_form) {
    server.Rest();
    run.report.AtMost("memory more, after a rest", server.Megabytes() - memory_before, 20, " MiB");
  }
  run.report.Holds("serves afterwards", server.Serves());
}

}  // namespace halflight::soak
