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

// Those that are not the same for every particle. `fits` has one for each light of the scene, null
// for those that cast no shadows. `keep_transmittance`: an output shows it.
std::vector<TileLight> ListLights(const Scene& scene, const std::vector<const LightFit*>& fits,
                                  bool keep_transmittance);

// Which of the listed lights has the transmittance of a light of the scene that casts shadows.
size_t SlotOf(const std::vector<TileLight>& lights, size_t light);

// Of the sprites of a run of a list, by their place in it. Owns what ShadedSprites points to, but
// for the sprites.
struct Shading {
  TileRun run;
  int lights = 0;
  int degree = 0;
  int exponents = 1;
  std::array<bool, kMaxTileLights> shadow_alone = {};
  std::vector<uint16_t> rows;
  std::vector<Rgb> unshadowed;
  std::vector<float> depth;
  std::vector<Rgb> lit;
  std::vector<float> exponent;
  std::vector<NearLight> near_lights;

  // `list` is the one that the run is of.
  [[nodiscard]] ShadedSprites View(const SpriteList& list) const;
};

// Depth in radii within which a particle fills so wide an angle that its shadow is not taken as
// linear in the image: the error of that is below the fit's from here on. Lights whose radiance
// varies over a sprite are better off with the linear form, which knows of it: near particles take
// it at their centre.
double NearDepth(const Scene& scene);

// `lights` are those listed of the scene, fitted to `degree`. `keep_depth`: an output shows it.
// Uses all cores.
Shading ShadeSprites(const Scene& scene, const ParticleView& particles, const Projection& eye,
                     const SpriteList& list, const TileRun& run,
                     const std::vector<TileLight>& lights, int degree, bool keep_depth);

}  // namespace halflight::sweep
