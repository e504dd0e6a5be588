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
  int light = 0;          // of the scene
  bool shadowed = false;  // it casts shadows, and has a fit
  bool varies = false;    // its radiance does, with place or ray
  bool adds = true;       // false: there only for its transmittance
};

// Those of a scene that cast shadows or vary, first all that add to the image. What the others give
// is in ConstantLight. `keep_transmittance`: an output shows it.
std::vector<TileLight> ListTileLights(const Scene& scene, bool keep_transmittance);
// Where the transmittance of a light of the scene is among them.
int TransmittanceSlot(const std::vector<TileLight>& lights, int light);
// The same everywhere: ambient light, and that of lights that neither cast shadows nor vary.
glm::vec3 ConstantLight(const Scene& scene);

// Of the sprites of a run of a list, by their place in it. Owns what ShadedSprites points to, but
// for the sprites.
struct Shading {
  TileRun run;
  int lights = 0;
  int degree = 0;
  int exponents = 1;
  std::array<bool, kMaxTileLights> shadow_alone = {};
  Block<uint16_t> rows;
  Block<Rgb> unshadowed;
  Block<float> depth;
  Block<Rgb> lit;
  Block<float> exponent;
  std::vector<NearLight> near_lights;

  // `list` is the one that the run is of.
  [[nodiscard]] ShadedSprites View(const SpriteList& list) const;
};

// Depth in radii within which a particle fills so wide an angle that its shadow is not taken as
// linear in the image: the error of that is below the fit's from here on. Lights whose radiance
// varies over a sprite are better off with the linear form, which knows of it: near particles take
// it at their centre.
double NearDepth(const Scene& scene);

// `lights` are those listed of the scene; `fits` has one for each light of the scene, made to
// `degree`, null for those that cast no shadows. `keep_depth`: an output shows it. Uses all cores.
Shading ShadeSprites(const Scene& scene, const ParticleView& particles, const Projection& eye,
                     const SpriteList& list, const TileRun& run,
                     const std::vector<TileLight>& lights, const std::vector<const LightFit*>& fits,
                     int degree, bool keep_depth);

}  // namespace halflight::sweep
