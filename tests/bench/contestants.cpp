#include "tests/bench/contestants.h"

#include <memory>

#include "absl/strings/str_cat.h"
#include "tests/bench/yardstick.h"

namespace halflight::bench {
namespace {

constexpr int kLightBuffer = 256;

Contestant LightSweep(int degree, int light_buffer_size) {
  ShadowSettings shadow;
  shadow.technique = ShadowTechniqueKind::kLightSweep;
  shadow.fit_degree = degree;
  shadow.light_buffer_size = light_buffer_size;
  return {absl::StrCat("light sweep, degree ", degree, ", buffer ", light_buffer_size), Role::kOurs,
          shadow};
}

// Layers along the light in place of its exact order, fitted as the sweep is.
Contestant Layered(int bins) {
  ShadowSettings shadow;
  shadow.technique = ShadowTechniqueKind::kParticleShadowMap;
  shadow.slices = bins;
  shadow.fit_degree = 3;
  shadow.light_buffer_size = kLightBuffer;
  return {absl::StrCat("layered, ", bins, " bins, degree 3"), Role::kOurs, shadow};
}

Contestant OnCpu(Contestant contestant) {
  contestant.name += ", on the CPU";
  contestant.sweep_on = SweepOn::kCpu;
  return contestant;
}

Contestant HandWritten() {
  ShadowSettings shadow;
  shadow.light_buffer_size = kLightBuffer;
  return {"yardstick", Role::kYardstick, shadow};
}

}  // namespace

Contestant Classic(Role role, int slices, bool interpolate) {
  ShadowSettings shadow;
  shadow.technique = ShadowTechniqueKind::kHalfAngle;
  shadow.slices = slices;
  shadow.interpolate = interpolate;
  shadow.compositor = SliceCompositor::kRaster;
  shadow.light_buffer_size = kLightBuffer;
  return {absl::StrCat("classic, ", slices, " slices", interpolate ? " interpolated" : ""), role,
          shadow};
}

namespace {

// The same slices by tiles in compute.
Contestant SlicesInTiles(int slices) {
  ShadowSettings shadow = Classic(Role::kOurs, slices, true).shadow;
  shadow.compositor = SliceCompositor::kTiles;
  return {absl::StrCat("slices in tiles, ", slices, " interpolated"), Role::kOurs, shadow};
}

}  // namespace

Contestant DefaultPath() {
  ShadowSettings shadow;
  shadow.technique = ShadowTechniqueKind::kLightSweep;
  return {"default path", Role::kOurs, shadow};
}

// To add a contestant: a row. What chooses another backend or technique is a field of
// Contestant, or else a case of DrawOf.
std::vector<Contestant> ListContestants(bool short_form, bool software) {
  std::vector<Contestant> all = {
      Classic(Role::kBaseline, 64, false),
      Classic(Role::kBaseline, 64, true),
      SlicesInTiles(64),
  };
  if (!short_form) {
    all.push_back(Classic(Role::kClassic, 128, false));
    all.push_back(Classic(Role::kClassic, 128, true));
    all.push_back(Layered(64));
    all.push_back(Layered(128));
  }
  for (const int light_buffer_size : {kLightBuffer, 512}) {
    for (int degree = 0; degree <= kMaxFitDegree; ++degree) {
      if (short_form && (degree > 1 || light_buffer_size != kLightBuffer)) continue;
      all.push_back(LightSweep(degree, light_buffer_size));
    }
  }
  if (!software) all.push_back(OnCpu(LightSweep(4, kLightBuffer)));
  if (Yardstick::Runs()) all.push_back(HandWritten());
  return all;
}

measure::Draw DrawOf(const Contestant& contestant, FrameRenderer& renderer) {
  if (contestant.role != Role::kYardstick) {
    return [draw = measure::DrawWith(renderer),
            sweep_on = contestant.sweep_on](const FrameRequest& request) {
      FrameRequest elsewhere = request;
      elsewhere.sweep_on = sweep_on;
      return draw(elsewhere);
    };
  }
  return [yardstick = std::make_shared<Yardstick>()](const FrameRequest& request) {
    return yardstick->Draw(request);
  };
}

Scene Apply(const Contestant& contestant, const Scene& scene) {
  Scene applied = scene;
  applied.shadow = contestant.shadow;
  return applied;
}

}  // namespace halflight::bench
