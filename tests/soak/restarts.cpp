// SIGTERM under load, again and again: what the server has accepted it delivers.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <iostream>
#include <map>
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

// What the clients have seen of each frame that they asked for, by its request id.
struct Seen {
  bool whole = false;
  int messages = 0;
  grpc::Status status{};
};

class Clients {
 public:
  Clients(const std::string& address, const client::EncodedParticles& particles) {
    for (int i = 0; i < kClients; ++i) {
      threads_.emplace_back([this, i, address, &particles](const std::stop_token& stop) {
        Work(i, address, particles, stop);
      });
    }
  }

  // Once they have stopped.
  std::map<std::string, Seen> Stop() {
    threads_.clear();
    return std::move(seen_);
  }
  [[nodiscard]] int whole() const { return whole_; }

 private:
  // One frame after the other. Another connection every few frames, so that some are just being
  // made.
  void Work(int client, const std::string& address, const client::EncodedParticles& particles,
            const std::stop_token& stop) {
    std::shared_ptr<grpc::Channel> channel;
    for (int frame = 0; !stop.stop_requested(); ++frame) {
      if (frame % 10 == 0) {
        channel = testing::NewChannel(address);
      }
      v1::RenderFrameRequest request = FrameOf(particles.sha256, frame % 3 == 0 ? 160 : 64, 8);
      request.set_request_id(fmt::format("frame-{}-{}", client, frame));
      v1::InlineParticles& inline_particles = *request.mutable_scene()->mutable_inline_particles();
      *inline_particles.mutable_layout() = particles.layout;
      inline_particles.set_payload(particles.payload);
      const auto call = Call::Start(channel, Ask(request));
      call->Wait();
      {
        const std::lock_guard lock(mutex_);
        seen_[request.request_id()] = {.whole = call->status().ok() && call->whole(),
                                       .messages = call->messages(),
                                       .status = call->status()};
      }
      whole_ += call->whole() ? 1 : 0;
      if (!call->status().ok()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
  }

  std::mutex mutex_;
  std::map<std::string, Seen> seen_;
  std::atomic<int> whole_ = 0;
  std::vector<std::jthread> threads_;
};

struct Losses {
  size_t whole = 0;
  size_t accepted = 0;      // as the log says
  size_t refused = 0;       // UNAVAILABLE, before anything had come
  size_t unfinished = 0;    // something had come, not all
  size_t otherwise = 0;     // refused with another code
  size_t never_came = 0;    // the log says accepted, the client has no frame
  size_t not_finished = 0;  // the log says accepted, and another outcome than OK
};

// The lines of an event that is of a request, by its id.
std::map<std::string, std::string> LinesOf(const std::string& event, const std::string& log) {
  std::map<std::string, std::string> lines;
  const std::string key = " " + event + " request_id=";
  for (size_t at = log.find(key); at != std::string::npos; at = log.find(key, at + 1)) {
    const size_t id_at = at + key.size();
    lines[log.substr(id_at, log.find_first_of(" \n", id_at) - id_at)] =
        log.substr(at, log.find('\n', at) - at);
  }
  return lines;
}

// That a frame was accepted is told when it is, what became of it at its end.
void ReadLog(const std::string& log, const std::map<std::string, Seen>& seen, Losses& losses) {
  const auto ends = LinesOf("frame", log);
  for (const auto& [id, line] : LinesOf("frame_accepted", log)) {
    ++losses.accepted;
    const auto found = seen.find(id);
    losses.never_came += found == seen.end() || !found->second.whole ? 1 : 0;
    const auto end = ends.find(id);
    losses.not_finished +=
        end == ends.end() || end->second.find("outcome=OK") == std::string::npos ? 1 : 0;
  }
}

}  // namespace

void RunRestarts(Run& run) {
  const testing::Folder folder;
  const std::string address = "unix:" + folder / "socket";
  std::vector<std::string> flags = {"--address", address, "--log-level", "debug"};
  if (run.sabotage) {
    flags.insert(flags.end(), {"--drain-seconds", "0"});
  }
  const client::EncodedParticles particles = BallOf(2000);
  std::mt19937 random(8);
  Losses losses;
  size_t other_exits = 0;
  double longest_drain_ms = 0.0;
  const int restarts = run.Of(100, 2);
  for (int i = 0; i < restarts; ++i) {
    Server server(folder, flags);
    Clients clients(address, particles);
    Require(testing::WaitFor([&] { return clients.whole() >= 4; }), "frames before the restart");
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 100));
    const auto begin = Clock::now();
    server.Signal(SIGTERM);
    other_exits += server.Wait() == 0 ? 0 : 1;
    const std::chrono::duration<double, std::milli> drain = Clock::now() - begin;
    longest_drain_ms = std::max(longest_drain_ms, drain.count());
    const std::map<std::string, Seen> seen = clients.Stop();
    for (const auto& [id, frame] : seen) {
      losses.whole += frame.whole ? 1 : 0;
      losses.unfinished += !frame.whole && frame.messages > 0 ? 1 : 0;
      if (!frame.whole && frame.messages == 0) {
        const bool refused = frame.status.error_code() == grpc::StatusCode::UNAVAILABLE;
        ++(refused ? losses.refused : losses.otherwise);
        if (!refused) {
          std::cerr << "soak: " << id << ": " << frame.status.error_code() << " "
                    << frame.status.error_message() << std::endl;
        }
      }
    }
    ReadLog(server.Err(), seen, losses);
  }
  run.report.AtLeast("restarts by SIGTERM under load", restarts, restarts, "");
  run.report.None("exit codes other than 0", other_exits);
  run.report.AtLeast("frames that came whole", static_cast<double>(losses.whole), 4 * restarts, "");
  run.report.AtLeast("frames that the log says were accepted", static_cast<double>(losses.accepted),
                     static_cast<double>(losses.whole), "");
  run.report.Tell("refused with UNAVAILABLE", static_cast<double>(losses.refused), "");
  run.report.None("frames that began to come and did not end", losses.unfinished);
  run.report.None("refused with another code", losses.otherwise);
  run.report.None("accepted by the log, and not whole at the client", losses.never_came);
  run.report.None("accepted by the log, with another outcome than OK", losses.not_finished);
  run.report.Tell("longest time from SIGTERM to the end", longest_drain_ms, " ms");
}

}  // namespace halflight::soak
