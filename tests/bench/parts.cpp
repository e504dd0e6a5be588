#include "tests/bench/parts.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "renderer/reference/evaluator.h"
#include "tests/bench/yardstick.h"
#include "tests/measure/plume_scene.h"
#include "tests/measure/timing.h"

namespace halflight::bench {
namespace {

using measure::TimedFrame;

struct Size {
  size_t particles;
  int width;
  int height;
};

constexpr Size kFrame = {65'536, 640, 512};
constexpr Size kShortFrame = {8'192, 96, 72};
constexpr std::array<size_t, 5> kCounts = {8'192, 65'536, 262'144, 1'048'576, 4'194'304};
constexpr std::array<std::pair<int, int>, 5> kResolutions = {
    {{320, 256}, {640, 512}, {1280, 720}, {1280, 1024}, {1920, 1080}}};
constexpr std::array<Size, 3> kDeviceSizes = {
    {{65'536, 1280, 1024}, {1'000'000, 1920, 1080}, {10'000'000, 1920, 1080}}};
constexpr std::array<int, 5> kSlices = {16, 32, 64, 128, 256};
// Above this the reference takes longer than all that it is to judge.
constexpr size_t kMostReferenced = 262'144;

constexpr int kTurntableFrames = 8;
constexpr double kTurntableStep = 3.0;  // degrees

class Bench {
 public:
  Bench(FrameRenderer& renderer, const MeasureOptions& options, const ParticleSet& plume)
      : renderer_(renderer), options_(options), plume_(plume) {}

  absl::StatusOr<Results> Run() {
    Results results;
    const std::pair<const char*, absl::Status (Bench::*)(Results&)> parts[] = {
        {"one frame", &Bench::MeasureFrame},
        {"against the number of particles", &Bench::MeasureParticles},
        {"against slices", &Bench::MeasureSlices},
        {"against resolution", &Bench::MeasureResolution},
        {"turntable", &Bench::MeasureTurntable},
        {"sizes for a device", &Bench::MeasureDeviceSizes},
    };
    for (const auto& [name, part] : parts) {
      options_.progress(name);
      if (absl::Status status = (this->*part)(results); !status.ok()) return status;
    }
    return results;
  }

 private:
  Scene SceneOf(const Size& size) const {
    return measure::PlumeScene(
        measure::Replicate(plume_, size.particles, measure::kPlumeOpacity, measure::kPlumeJitter),
        measure::kSideLight, size.width, size.height);
  }
  Size FrameSize() const { return options_.short_form ? kShortFrame : kFrame; }
  // Frames of a million particles take seconds.
  int RepeatsOf(size_t particles) const {
    return Repeats(particles > 1'048'576 ? 2 : (particles > kMostReferenced ? 3 : 7));
  }
  int Repeats(int most) const { return options_.short_form ? 2 : std::min(options_.repeats, most); }

  static Row RowOf(std::string name, Role role, const Scene& scene, const TimedFrame& frame) {
    Row row;
    row.name = std::move(name);
    row.role = role;
    row.particles = scene.particles->size();
    row.width = scene.camera.width;
    row.height = scene.camera.height;
    row.slices = scene.shadow.slices;
    if (!frame.status.ok()) {
      row.failure = frame.status.ToString();
      return row;
    }
    row.milliseconds = frame.milliseconds;
    row.stages = measure::MedianStages(frame);
    return row;
  }

  // All contestants on one scene. Errors at every pixel, or at a sample of them.
  absl::StatusOr<Group> MeasureGroup(const Scene& scene, const std::vector<Contestant>& contestants,
                                     int repeats, bool every_pixel) {
    std::vector<measure::Entrant> entrants;
    for (const Contestant& contestant : contestants) {
      entrants.push_back({DrawOf(contestant, renderer_), Apply(contestant, scene)});
    }
    const std::vector<TimedFrame> frames = measure::TimeInTurns(entrants, repeats);
    Group group;
    for (size_t i = 0; i < contestants.size(); ++i) {
      group.push_back(
          RowOf(contestants[i].name, contestants[i].role, entrants[i].scene, frames[i]));
    }
    if (scene.particles->size() > kMostReferenced) return group;
    if (every_pixel) {
      const measure::CoveredReference reference = measure::EvaluateCovered(scene);
      for (size_t i = 0; i < group.size(); ++i) {
        if (!group[i].failure.empty()) continue;
        group[i].error = measure::CompareAll(frames[i].beauty, reference);
      }
      return group;
    }
    const auto evaluator = reference::Evaluator::Create(scene);
    if (!evaluator.ok()) return evaluator.status();
    for (size_t i = 0; i < group.size(); ++i) {
      if (!group[i].failure.empty()) continue;
      const auto error = measure::CompareSample(frames[i].beauty, **evaluator);
      if (!error.ok()) return error.status();
      group[i].error = *error;
    }
    return group;
  }

  static std::vector<Contestant> Few() {
    std::vector<Contestant> few = {Classic(Role::kBaseline, 64, false), DefaultPath()};
    for (Contestant& contestant : ListContestants(true, true)) {
      if (contestant.role == Role::kYardstick) few.push_back(std::move(contestant));
    }
    return few;
  }

  absl::Status MeasureFrame(Results& results) {
    auto group = MeasureGroup(SceneOf(FrameSize()),
                              ListContestants(options_.short_form, renderer_.device().software),
                              Repeats(options_.repeats), true);
    if (!group.ok()) return group.status();
    results.frame = *std::move(group);
    return absl::OkStatus();
  }

  absl::Status MeasureParticles(Results& results) {
    for (const size_t count : kCounts) {
      if (options_.short_form && count > kCounts.front()) continue;
      Size size = FrameSize();
      size.particles = count;
      auto group = MeasureGroup(SceneOf(size), Few(), RepeatsOf(count), false);
      if (!group.ok()) return group.status();
      results.particles.push_back(*std::move(group));
    }
    return absl::OkStatus();
  }

  absl::Status MeasureSlices(Results& results) {
    std::vector<Contestant> contestants;
    for (const int slices : kSlices) contestants.push_back(Classic(Role::kClassic, slices, false));
    for (const int slices : kSlices) {
      contestants.push_back(DefaultPath());
      contestants.back().shadow.slices = slices;
    }
    auto group = MeasureGroup(SceneOf(FrameSize()), contestants, Repeats(11), false);
    if (!group.ok()) return group.status();
    results.slices = *std::move(group);
    return absl::OkStatus();
  }

  absl::Status MeasureResolution(Results& results) {
    for (const auto& [width, height] : kResolutions) {
      if (options_.short_form && width > kResolutions.front().first) continue;
      auto group =
          MeasureGroup(SceneOf({FrameSize().particles, width, height}), Few(), Repeats(5), false);
      if (!group.ok()) return group.status();
      results.resolution.push_back(*std::move(group));
    }
    return absl::OkStatus();
  }

  // One renderer; particles that it has never seen, then the same ones again from other sides.
  absl::Status MeasureTurntable(Results& results) {
    for (const Contestant& contestant : {Classic(Role::kBaseline, 64, false), DefaultPath()}) {
      const Scene scene = Apply(contestant, SceneOf(FrameSize()));
      const measure::Draw draw = measure::DrawWith(renderer_);
      TimedFrame first;
      TimedFrame following;
      for (int turn = 0; turn <= Repeats(9); ++turn) {
        FrameRequest request = measure::FirstSeen(scene);
        TimedFrame turned;
        for (int i = 0; i < kTurntableFrames; ++i) {
          request.scene.camera = measure::PlumeCamera(
              scene.camera.width, scene.camera.height,
              kTurntableStep * static_cast<double>(turn * kTurntableFrames + i));
          measure::TimeFrame(draw, request, i == 0 ? first : turned);
        }
        if (!first.status.ok() || !turned.status.ok()) {
          following.status = first.status.ok() ? turned.status : first.status;
          first.status = following.status;
          break;
        }
        if (turn == 0) {  // warms up
          first = TimedFrame{};
          continue;
        }
        following.milliseconds.push_back(measure::Median(turned.milliseconds));
        following.stages.push_back(measure::MedianStages(turned));
      }
      results.turntable.push_back(
          RowOf(contestant.name + ", first frame", contestant.role, scene, first));
      results.turntable.push_back(
          RowOf(contestant.name + ", following frames", contestant.role, scene, following));
    }
    return absl::OkStatus();
  }

  absl::Status MeasureDeviceSizes(Results& results) {
    if (!options_.device_sizes) return absl::OkStatus();
    for (const Size& size : kDeviceSizes) {
      if (options_.short_form && size.particles > kDeviceSizes.front().particles) continue;
      auto group = MeasureGroup(SceneOf(size), Few(), RepeatsOf(size.particles), false);
      if (!group.ok()) return group.status();
      results.device.push_back(*std::move(group));
    }
    return absl::OkStatus();
  }

  FrameRenderer& renderer_;
  const MeasureOptions& options_;
  const ParticleSet& plume_;
};

}  // namespace

absl::StatusOr<Results> MeasureAll(FrameRenderer& renderer, const MeasureOptions& options) {
  const auto plume = measure::LoadPlumeFrame(options.data_folder, "0040");
  if (!plume.ok()) return plume.status();
  return Bench(renderer, options, **plume).Run();
}

}  // namespace halflight::bench
