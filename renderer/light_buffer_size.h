// How large a light buffer is where the request leaves it open.
#pragma once

#include "renderer/particle_view.h"
#include "renderer/scene.h"

namespace halflight {

// Texels along each side of every light buffer of a frame: what the scene asks for, or else as many
// as let a typical particle's radius take five and a half of them, as the light sees it for which
// that takes most. Typical is the radius below which particles hold a tenth of the cloud's optical
// depth times area. A multiple of 64 from 64 to 1024, and no more than is allowed. That is what the
// light sweep and the particle shadow map can use; other techniques get 512. docs/target-error.md
// has the measurement. Any thread; deterministic. Goes over all particles once for each light that
// casts shadows.
int LightBufferSizeFor(const Scene& scene, const ParticleView& particles);

// The most that it gives for these settings under a technique, whatever the particles.
int LargestLightBufferSize(const ShadowSettings& shadow, ShadowTechniqueKind technique);

}  // namespace halflight
