// What the lights make of every particle, in buffers of the device: ShadeSprites for the tile
// compositor there. Composites nothing.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "renderer/gpu.h"
#include "renderer/passes/project.h"
#include "renderer/scene.h"
#include "renderer/sweep/device/light_fit.h"
#include "renderer/sweep/device/lists.h"
#include "renderer/sweep/shading.h"

namespace halflight::sweep {

// How particles in the light are kept: see shaders/tile_records.glsl. At degree d, with one density
// for all colours, without near particles and outputs of depth: 48 bytes a particle, and for each
// light 4 (1 + (d + 1) (d + 2) / 2).
struct ShadedLayout {
  std::vector<TileLight> lights;  // one slot each
  int degree = 0;
  bool colored_density = false;
  bool has_near = false;
  bool has_depth = false;

  [[nodiscard]] size_t head_bytes() const;    // a particle
  [[nodiscard]] size_t record_bytes() const;  // a particle and slot
  // The constants of shaders that read or write it.
  [[nodiscard]] gl::Constants constants() const;
};

// `keep_depth` and `keep_transmittance`: an output shows them.
ShadedLayout LayOutShading(const Scene& scene, const DeviceSprites& sprites, int degree,
                           bool keep_depth, bool keep_transmittance);

// Part of an order in the light.
struct ShadedPlaces {
  PlaceRun run;
  gl::Buffer heads;
  gl::Buffer records;  // by place, then by slot
};

// Runs that are shaded begin at multiples of this.
inline constexpr size_t kShadedAlignment = 256;

// How many places can be shaded at once so that no buffer is larger than `most_bytes`: a multiple
// of the alignment, and at least that.
size_t MostShadedPlaces(const ShadedLayout& layout, size_t most_bytes);

// `fits` has one for each light of the scene, null for those that cast no shadows. Formulas and
// approximations are those of ShadeSprites, in float32. ResourceExhausted where a storage block
// does not hold what is read or made. Needs a current context.
absl::StatusOr<ShadedPlaces> ShadePlaces(Gpu& gpu, const Scene& scene,
                                         const ParticleBuffers& particles,
                                         const TargetProjection& eye, const DeviceSprites& sprites,
                                         const std::vector<const DeviceLightFit*>& fits,
                                         const ShadedLayout& layout, const PlaceRun& run);

}  // namespace halflight::sweep
