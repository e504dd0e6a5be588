// What the lights make of every particle, as the compositor's kernels want it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "renderer/particle_view.h"
#include "renderer/projection.h"
#include "renderer/scene.h"
#include "renderer/sweep/kernels.h"
#include "renderer/sweep/light_fit.h"
#include "renderer/sweep/sprites.h"

namespace halflight::sweep {

// A light among those that the kernels add up.
struct TileLight {
  int light = 0;                  // of the scene
  const LightFit* fit = nullptr;  // null: it casts no shadows
  bool varies = false;            // its radiance does, with place or ray
  bool adds = true;               // false: there only for its transmittance
};

// Owns what ShadedSprites points to, but for the sprites.
struct Shading {
  std::vector<TileLight> lights;
  int degree = 0;
  int exponents = 1;
  std::array<bool, kMaxTileLights> shadow_alone = {};
  Block<uint16_t> rows;
  Block<Rgb> unshadowed;
  Block<float> depth;
  Block<Rgb> lit;
  Block<float> exponent;
  std::vector<NearLight> near_lights;

  [[nodiscard]] ShadedSprites View(const SpriteList& list) const;
  // Where the transmittance of a light of the scene is among `lights`.
  [[nodiscard]] int SlotOf(int light) const;
};

// Depth in radii within which a particle fills so wide an angle that its shadow is not taken as
// linear in the image: the error of that is below the fit's from here on. Lights whose radiance
// varies over a sprite are better off with the linear form, which knows of it: near particles take
// it at their centre.
double NearDepth(const Scene& scene);

// `fits` has one for each light of the scene, null for those that cast no shadows. `keep_depth` and
// `keep_transmittance`: an output shows them.
Shading ShadeSprites(const Scene& scene, const ParticleView& particles, const Projection& eye,
                     const SpriteList& list, const std::vector<const LightFit*>& fits, int degree,
                     bool keep_depth, bool keep_transmittance);

}  // namespace halflight::sweep
