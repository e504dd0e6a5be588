// Who takes part: ways to draw a frame, each with a name. Leaves out on what; see parts.h.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/frame.h"
#include "renderer/scene.h"
#include "tests/measure/timing.h"

namespace halflight::bench {

enum class Role : uint8_t {
  kBaseline,   // classic slicing, as the goals mean it
  kClassic,    // the same with other settings
  kOurs,       // what the goals are set for
  kYardstick,  // what the machine can do
};

struct Contestant {
  std::string name;  // one name, one way to draw
  Role role;
  ShadowSettings shadow;
  SweepOn sweep_on = SweepOn::kAuto;
};

// All of them, or those of the short form. Without the yardstick where the CPU cannot run it; on a
// GPU also with the light sweep on the CPU, which a software renderer has as its own.
std::vector<Contestant> ListContestants(bool short_form, bool software);

// Slicing by the raster path.
Contestant Classic(Role role, int slices, bool interpolate);

// What draws a frame where a request names the light sweep and nothing else.
Contestant DefaultPath();

// Makes frames of a contestant's scenes; `renderer` must outlive it.
measure::Draw DrawOf(const Contestant& contestant, FrameRenderer& renderer);

// `scene` as the contestant draws it.
Scene Apply(const Contestant& contestant, const Scene& scene);

}  // namespace halflight::bench
