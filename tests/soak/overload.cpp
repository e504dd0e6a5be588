// Ten times as many frames asked for as can be drawn, by several tenants: as many are drawn as
// before, and who has to wait is told at once.

#include <sched.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <thread>
#include <vector>

#include "halflight/sha256.h"
#include "tests/access/health.h"
#include "tests/measure/timing.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

constexpr int kTenants = 4;

std::string TokenOf(int tenant) { return "token-of-tenant-" + std::to_string(tenant); }

std::string TokenFile(const testing::Folder& folder) {
  std::string lines;
  for (int i = 0; i < kTenants; ++i) {
    lines += ToHex(Sha256Of(TokenOf(i))) + " tenant" + std::to_string(i) + "\n";
  }
  return folder.Write("tokens", lines);
}

// Clients of this machine take cores that clients elsewhere would not. So these take what the
// server leaves: all threads of this process, and those that they will make, are of the scheduler's
// idle class (sched(7)).
void TakeIdleTimeOnly() {
  const sched_param none{};
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    const int tid = std::stoi(thread.path().filename());
    Require(sched_setscheduler(tid, SCHED_IDLE, &none) == 0 || errno == ESRCH, "SCHED_IDLE");
  }
}

// What came of the calls that ended within a stretch of time.
struct Stretch {
  double seconds = 0.0;
  int frames = 0;
  std::vector<double> refusals_ms;  // anything but a frame
  size_t otherwise = 0;             // of these not for want of room
  int calls = 0;

  [[nodiscard]] double rate() const { return frames / seconds; }
};

class Load {
 public:
  // A client gives up a frame for which it has waited for so long.
  Load(const Server& server, const v1::RenderFrameRequest& request,
       std::chrono::milliseconds patience)
      : request_(request), patience_(patience) {
    for (int i = 0; i < kTenants; ++i) {
      channels_.push_back(testing::NewChannel(server.address()));
    }
  }

  // Each tenant has one frame under way, and asks for the next when that has come.
  Stretch Peak(std::chrono::duration<double> time) {
    Stretch stretch;
    const auto begin = Clock::now();
    std::vector<std::shared_ptr<Call>> calls(kTenants);
    const auto ask = [&](int tenant) { calls[tenant] = Begin(tenant); };
    for (int i = 0; i < kTenants; ++i) {
      ask(i);
    }
    while (Clock::now() - begin < time) {
      for (int i = 0; i < kTenants; ++i) {
        if (calls[i]->done()) {
          Count(*calls[i], stretch);
          ask(i);
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    stretch.seconds = Since(begin);
    Drop(calls);
    return stretch;
  }

  // Calls at equal distances, whatever becomes of those before. What is under way at first and at
  // the end is left out: the stretch begins when the queue is full.
  Stretch Overload(double calls_per_second, std::chrono::duration<double> time) {
    constexpr std::chrono::milliseconds kFill(500);
    Stretch stretch;
    std::vector<std::shared_ptr<Call>> under_way;
    const auto start = Clock::now();
    const auto begin = start + kFill;
    const std::chrono::duration<double> distance(1.0 / calls_per_second);
    for (int i = 0; Clock::now() < begin + std::chrono::duration_cast<Clock::duration>(time); ++i) {
      std::this_thread::sleep_until(start +
                                    std::chrono::duration_cast<Clock::duration>(i * distance));
      under_way.push_back(Begin(i % kTenants));
      std::erase_if(under_way, [&](const std::shared_ptr<Call>& call) {
        const bool ended = call->done();
        if (ended && call->ended() >= begin) {
          Count(*call, stretch);
        }
        return ended;
      });
    }
    stretch.seconds = Since(begin);
    Drop(under_way);
    return stretch;
  }

 private:
  static double Since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }

  std::shared_ptr<Call> Begin(int tenant) {
    CallOptions options = Ask(request_);
    options.token = TokenOf(tenant);
    options.deadline = patience_;
    return Call::Start(channels_[tenant], std::move(options));
  }

  static void Count(const Call& call, Stretch& stretch) {
    ++stretch.calls;
    const grpc::StatusCode code = call.status().error_code();
    if (code == grpc::StatusCode::OK && call.whole()) {
      ++stretch.frames;
    } else {
      stretch.refusals_ms.push_back(call.milliseconds());
      stretch.otherwise += code == grpc::StatusCode::RESOURCE_EXHAUSTED ? 0 : 1;
    }
  }

  static void Drop(const std::vector<std::shared_ptr<Call>>& calls) {
    for (const auto& call : calls) {
      call->Cancel();
    }
    for (const auto& call : calls) {
      call->Wait();
    }
  }

  const v1::RenderFrameRequest request_;
  const std::chrono::milliseconds patience_;
  std::vector<std::shared_ptr<grpc::Channel>> channels_;
};

}  // namespace

void RunOverload(Run& run) {
  const testing::Folder folder;
  std::vector<std::string> flags = {"--token-file", TokenFile(folder)};
  if (run.sabotage) {
    flags.insert(flags.end(), {"--max-queued-frames", "65536", "--max-client-frames", "65536"});
  } else {
    flags.insert(flags.end(), {"--max-queued-frames", "12", "--max-client-frames", "4"});
  }
  const Server server(folder, flags);
  if (!run.short_form) {  // which runs beside other tests, that leave no idle time
    TakeIdleTimeOnly();   // after the server has begun, which would be of that class too
  }
  const client::EncodedParticles particles = BallOf(3000);
  Upload(server.address(), particles, TokenOf(0));
  Load load(server,
            run.short_form ? FrameOf(particles.sha256, 96, 16) : FrameOf(particles.sha256, 192, 24),
            std::chrono::milliseconds(run.sabotage ? 700 : 10000));
  load.Peak(std::chrono::milliseconds(500));  // warm

  const int turns = run.Of(8, 1);
  const std::chrono::duration<double> time(run.short_form ? 1.0 : 10.0);
  std::vector<double> ratios;
  std::vector<double> peaks;
  std::vector<double> refusals;
  std::vector<double> offered;
  size_t otherwise = 0;
  for (int turn = 0; turn < turns; ++turn) {
    // The peak before and after: what else the machine does changes while one measures.
    const double before = load.Peak(time / 2).rate();
    Require(before > 0.0, "a frame at the peak");
    const Stretch over = load.Overload(10.0 * before, time);
    const double after = load.Peak(time / 2).rate();
    const double peak = 0.5 * (before + after);
    peaks.push_back(peak);
    ratios.push_back(100.0 * over.rate() / peak);
    std::fprintf(stderr, "soak: turn %d: %.1f frames a second, then %.1f, then %.1f\n", turn,
                 before, over.rate(), after);
    offered.push_back(over.calls / over.seconds / peak);
    otherwise += over.otherwise;
    refusals.insert(refusals.end(), over.refusals_ms.begin(), over.refusals_ms.end());
  }
  Require(!refusals.empty(), "refusals under overload");
  run.report.Tell("frames a second at the peak, median of turns", measure::Median(peaks), "");
  run.report.Tell("calls ended under overload, times the peak's frames", measure::Median(offered),
                  "");
  run.report.RateAtLeast("frames under overload of those at the peak, median of turns",
                         measure::Median(ratios), 90, " %");
  run.report.Tell("the same, smallest and largest turn",
                  Digits(*std::min_element(ratios.begin(), ratios.end())) + " to " +
                      Digits(*std::max_element(ratios.begin(), ratios.end())) + " %");
  run.report.Tell("refusals", static_cast<double>(refusals.size()), "");
  run.report.None("refused for another reason than want of room", otherwise);
  run.report.Tell("refusals answered within, median", measure::Median(refusals), " ms");
  run.report.TimeAtMost("refusals answered within, 99th percentile",
                        measure::Quantile(refusals, 0.99), 50, " ms");
  run.report.TimeAtMost("refusals answered within, longest", measure::Quantile(refusals, 1.0), 50,
                        " ms");
  run.report.Holds("serves afterwards", server.Serves());
}

}  // namespace halflight::soak
