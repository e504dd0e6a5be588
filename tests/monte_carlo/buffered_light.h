// The light that a rendered frame holds for its particles.
// Reads the frame's light layers; knows no scattering.
#pragma once

#include <vector>

#include "renderer/frame.h"

namespace halflight::monte_carlo {

// Transmittance of the scene's first light at each particle: its mean over the particle, weighted
// as by its extinction. `frame` is of the scene, its first image the transmittance of that light's
// layers; the light casts the same shadows in all colours. The layers are taken for a texture of
// three dimensions, in which optical depth is linear between one layer and the next.
std::vector<double> LightAtParticles(const Scene& scene, const FrameResult& frame);

}  // namespace halflight::monte_carlo
