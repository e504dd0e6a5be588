// How soon the renderer is free of a frame that was cancelled, or whose deadline has passed:
// another client's small frame comes as if the other had never been.

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/access/health.h"
#include "tests/process/wait_for.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

// Each takes seconds when it is left alone.
std::vector<std::pair<std::string, v1::RenderFrameRequest>> LongFrames(const std::string& sha256) {
  std::vector<std::pair<std::string, v1::RenderFrameRequest>> frames;
  frames.emplace_back("half-angle slicing, 20,000 slices", FrameOf(sha256, 512, 20000));
  frames.emplace_back("light sweep, 8192 x 8192", SweepOf(sha256, 8192));
  v1::RenderFrameRequest reference = SweepOf(sha256, 512);
  reference.mutable_scene()->mutable_shadow()->set_technique(v1::SHADOW_TECHNIQUE_REFERENCE);
  frames.emplace_back("reference", reference);
  v1::RenderFrameRequest scattering = FrameOf(sha256, 512, 20000);
  scattering.mutable_scene()->mutable_material()->set_scattering_spread(0.2F);
  frames.emplace_back("scattering, 20,000 slices", scattering);
  return frames;
}

double Milliseconds(Clock::time_point since) {
  return std::chrono::duration<double, std::milli>(Clock::now() - since).count();
}

}  // namespace

void RunStopping(Run& run) {
  const testing::Folder folder;
  std::vector<std::string> flags;
  if (run.sabotage) {
    flags = {"--device", "deaf"};
  }
  const Server server(folder, flags, run.sabotage ? "halflightd_broken" : "halflightd");
  const client::EncodedParticles particles = BallOf(50000);
  const client::EncodedParticles few = BallOf(100, 2);
  Upload(server.address(), particles);
  Upload(server.address(), few);
  const auto channel = testing::NewChannel(server.address());
  const v1::RenderFrameRequest small = SweepOf(few.sha256, 16);
  std::vector<double> alone;
  for (int i = 0; i < 20; ++i) {
    const auto begin = Clock::now();
    MustRender(channel, small);
    alone.push_back(Milliseconds(begin));
  }
  std::nth_element(alone.begin(), alone.begin() + 10, alone.end());
  run.report.Tell("a small frame by itself, median", alone[10], " ms");

  std::mt19937 random(5);
  for (const auto& [name, request] : LongFrames(particles.sha256)) {
    std::vector<double> waits;
    size_t too_short = 0;
    for (int i = 0; i < run.Of(20, 2); ++i) {
      CallOptions ask = Ask(request);
      const std::chrono::milliseconds time(150 + random() % 500);
      const bool by_deadline = i % 2 == 1;
      if (by_deadline) {
        ask.deadline = time;
      }
      const auto call = Call::Start(testing::NewChannel(server.address()), ask);
      std::this_thread::sleep_for(time);
      const auto begin = Clock::now();
      if (!by_deadline) {
        call->Cancel();
      }
      MustRender(channel, small);
      waits.push_back(Milliseconds(begin) - alone[10]);
      too_short += call->Wait().error_code() == (by_deadline ? grpc::StatusCode::DEADLINE_EXCEEDED
                                                             : grpc::StatusCode::CANCELLED)
                       ? 0
                       : 1;
    }
    std::sort(waits.begin(), waits.end());
    run.report.None(name + ": ended before they were told to", too_short);
    run.report.Tell(name + ": until the renderer is free, median", waits[waits.size() / 2], " ms");
    run.report.TimeAtMost(name + ": until the renderer is free, longest", waits.back(), 100, " ms");
  }
}

}  // namespace halflight::soak
