#include "tests/report/settings.h"

#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"

namespace halflight::report {
namespace {

constexpr int kNoSteps = -1;  // of a technique that has none
constexpr size_t kAll = std::numeric_limits<size_t>::max();

// To add a technique: a row, and its name in FlagOf. Names hold no commas, for the sake of CSV.
struct Curve {
  const char* name;
  ShadowTechniqueKind technique;
  bool interpolate;
  int light_buffer_size;  // 0: the technique has none
  int downsample;
  std::vector<int> steps;  // slices, or of the light sweep degrees
  // Measured against the number of particles: this step, up to so many particles.
  int scaling_step;
  size_t scaling_most;
};

std::vector<Curve> Curves() {
  using enum ShadowTechniqueKind;
  return {
      {"plain", kHalfAngle, false, 512, 1, {16, 64, 256, 512}, 64, kAll},
      {"interpolated", kHalfAngle, true, 512, 1, {32, 128, 512}, 128, kAll},
      {"interpolated (buffer 256)", kHalfAngle, true, 256, 1, {64, 256}, kNoSteps, 0},
      {"half resolution", kHalfAngle, true, 256, 2, {16, 32, 64, 128, 256}, 64, kAll},
      {"quarter resolution", kHalfAngle, true, 128, 4, {16, 64, 256}, 64, kAll},
      {"light sweep", kLightSweep, false, 256, 1, {1, 2, 3, 4, 6}, 4, kAll},
      {"light sweep at half resolution", kLightSweep, false, 128, 2, {1, 2, 4}, 2, kAll},
      {"reference", kReference, false, 0, 1, {kNoSteps}, kNoSteps, 65'536},
  };
}

const char* FlagOf(ShadowTechniqueKind technique) {
  switch (technique) {
    case ShadowTechniqueKind::kHalfAngle:
      return "half-angle";
    case ShadowTechniqueKind::kReference:
      return "reference";
    case ShadowTechniqueKind::kLightSweep:
      return "light-sweep";
    case ShadowTechniqueKind::kParticleShadowMap:
      return "particle-shadow-map";
  }
  return "";
}

Setting SettingOf(const Curve& curve, size_t index, int step) {
  Setting setting;
  setting.curve = curve.name;
  setting.curve_index = index;
  setting.shadow.technique = curve.technique;
  setting.sampling.downsample = curve.downsample;
  setting.flags = absl::StrCat("--technique ", FlagOf(curve.technique));
  setting.name = curve.name;
  if (step != kNoSteps) setting.label = absl::StrCat(step);
  if (curve.technique == ShadowTechniqueKind::kHalfAngle) {
    setting.name = absl::StrCat(step, " ", curve.name);
    setting.shadow.slices = step;
    setting.shadow.interpolate = curve.interpolate;
    absl::StrAppend(&setting.flags, " --slices ", step, curve.interpolate ? "" : " --plain");
  } else if (curve.technique == ShadowTechniqueKind::kLightSweep) {
    setting.name = absl::StrCat(curve.name, " of degree ", step);
    setting.shadow.fit_degree = step;
    absl::StrAppend(&setting.flags, " --fit-degree ", step);
  }
  if (curve.light_buffer_size > 0) {
    setting.shadow.light_buffer_size = curve.light_buffer_size;
    absl::StrAppend(&setting.flags, " --light-buffer ", curve.light_buffer_size);
  }
  if (curve.downsample > 1) absl::StrAppend(&setting.flags, " --downsample ", curve.downsample);
  return setting;
}

}  // namespace

std::vector<Setting> ListSettings(bool short_form) {
  constexpr int kBaselineSlices = 64;  // of the first curve
  constexpr int kShortSlices = 16;
  const std::vector<Curve> curves = Curves();
  std::vector<Setting> settings;
  for (size_t i = 0; i < curves.size(); ++i) {
    for (const int step : curves[i].steps) {
      const bool scaling = step == curves[i].scaling_step && curves[i].scaling_most > 0;
      if (short_form && !scaling && step != kShortSlices) continue;
      Setting setting = SettingOf(curves[i], i, step);
      setting.baseline = i == 0 && step == kBaselineSlices;
      setting.scaling_most = scaling ? curves[i].scaling_most : 0;
      settings.push_back(std::move(setting));
    }
  }
  return settings;
}

Scene Apply(const Setting& setting, const Scene& scene) {
  Scene applied = scene;
  applied.shadow = setting.shadow;
  applied.sampling = setting.sampling;
  return applied;
}

}  // namespace halflight::report
