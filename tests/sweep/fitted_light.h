// Light over particles' footprints as plain numbers: how far two fits of it are from each other,
// and a fit in float64. Knows no device.
#pragma once

#include <vector>

#include "renderer/scene.h"
#include "renderer/sweep/kernels.h"
#include "renderer/sweep/light_fit.h"

namespace halflight::sweep {

struct FittedLight {
  std::vector<float> depth;     // as in LightFit
  std::vector<Sprite> sprites;  // by particle
  std::vector<float> behind;    // all particles, by texel

  // To the last bit.
  bool operator==(const FittedLight& other) const;
};

// As a light's projection sees the particles: by particle.
std::vector<Sprite> SpritesByParticle(const ParticleView& particles, const Projection& light);

// Of the optical depth that the scene's first light met, with the scene's settings.
FittedLight FitOnCpu(const Scene& scene);
// The same, every particle one after another in float64, from sprites and rectangles as ListSprites
// rounds them; rounded at the end.
FittedLight FitInFloat64(const Scene& scene);

// Depths in units of the largest one behind all particles.
struct FitDifference {
  double rms = 0.0;      // of depths over the discs of all sprites
  double largest = 0.0;  // of those
  double behind = 0.0;   // the largest over the light buffer
  double sprites = 0.0;  // the largest of their numbers, relative to each
};
// All infinite where the sizes differ.
FitDifference Between(const FittedLight& fit, const FittedLight& expected, int degree);

}  // namespace halflight::sweep
