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
#include "renderer/sweep/kernels.h"

namespace halflight::sweep {

struct LightFit {
  Projection projection;
  int degree = 0;
  // By particle, Terms(degree) coefficients: the optical depth that the light met before it, as a
  // polynomial in the scaled coordinates of `sprites`.
  Block<float> depth;
  Block<Sprite> sprites;  // by particle
  Image optical_depth;    // behind all particles; Y
};

// `degree` 0 to kMaxDegree. Deposits the particles nearest the light first, each as the light
// buffer's texels show it, and fits to the texels it covers what lay before. Cancelled when `stop`
// says so. Any thread; uses all cores.
absl::StatusOr<LightFit> FitLight(const Light& light, const ParticleView& particles,
                                  Profile profile, int light_buffer_size, int degree,
                                  const std::stop_token& stop);

}  // namespace halflight::sweep
