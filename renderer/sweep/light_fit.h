// The light sweep: how much of a light every particle gets over its own footprint, as a polynomial.
#pragma once

#include <stop_token>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/block_cache.h"
#include "renderer/image.h"
#include "renderer/particle_view.h"
#include "renderer/projection.h"
#include "renderer/scene.h"
#include "renderer/sweep/tiles.h"

namespace halflight::sweep {

struct LightFit {
  Projection projection;
  int degree = 0;
  // By particle, Terms(degree) coefficients: the optical depth that the light met before it, as a
  // polynomial in its scaled coordinates as `projection` sees it.
  Block<float> depth;
  Image optical_depth;  // behind all particles; Y

  [[nodiscard]] size_t bytes() const {
    return (depth.capacity() + optical_depth.pixels.capacity()) * sizeof(float);
  }
};

// What a fit is made with. Sums of a particle that lies across tiles wait for all of its tiles:
// 2 * Terms(degree) floats an entry, at most 59 MiB at degree 4 with these limits.
inline constexpr RunLimits kLightRuns{.rects = 1U << 18U, .entries = 1U << 19U};

// `degree` 0 to kMaxDegree. Deposits the particles nearest the light first, each as the light
// buffer's texels show it, and fits to the texels it covers what lay before. Does not depend on the
// light's colour or density. Cancelled when `stop` says so. Any thread; uses all cores. The result
// is the same for all `limits`, which bound what is held besides.
absl::StatusOr<LightFit> FitLight(const Light& light, const ParticleView& particles,
                                  Profile profile, int light_buffer_size, int degree,
                                  const std::stop_token& stop,
                                  const RunLimits& limits = kLightRuns);

}  // namespace halflight::sweep
