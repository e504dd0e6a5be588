// The light sweep of ../light_fit.h in compute shaders: the same formulas and the same result, left
// on the device.
//
// Runs of particles, in the order of the light, go through two passes. In the first a workgroup a
// tile of the light buffer walks its particles, an invocation a texel; what the texel holds when a
// particle is met goes into the particle's patch (shaders/sweep_light.comp). In the second a few
// invocations a particle fit its patch (shaders/fit_light.comp). Every float is written by one
// invocation and added up in one order: the same request gives the same bytes.
//
// What limits it: the first pass has as many invocations as the light buffer has texels, 65,536 for
// 256 x 256, which do not fill a large GPU, and ends with its longest tile; smaller tiles shorten
// that one. Memory traffic is 8 bytes a fragment of the light, written and read once, and 32 bytes
// an entry of a tile. The frame waits for the device once a light, to cut it into runs.
//
// Memory on the device, at degree d: 48 bytes a particle and 4 more for each of its
// (d + 1) (d + 2) / 2 coefficients, of which 16 and the coefficients stay; 4 for each texel of a
// run's rectangles, up to PatchRunLimits::texels; a run's tile lists; 4 a texel of the light
// buffer.
#pragma once

#include <stop_token>

#include "absl/status/statusor.h"
#include "renderer/frame_engine.h"
#include "renderer/gpu.h"
#include "renderer/image.h"
#include "renderer/particle_view.h"
#include "renderer/projection.h"
#include "renderer/readback.h"
#include "renderer/scene.h"
#include "renderer/sweep/device/lists.h"
#include "renderer/sweep/device/runs.h"

namespace halflight::sweep {

// LightFit, in buffers.
struct DeviceLightFit {
  Projection projection;
  int degree = 0;
  gl::Buffer depth;          // float[Terms(degree) * N], by particle
  gl::Buffer sprites;        // vec4[N], by particle, as Sprite
  gl::Buffer optical_depth;  // float[size * size], row by row: behind all particles
  size_t count = 0;          // N

  // On the device.
  [[nodiscard]] size_t bytes() const;
};

struct LightSweepSettings {
  PatchRunLimits limits;
  int light_tile = 8;  // texels along each side, an invocation each: 8 to 16
};
// Runs as the device can walk them.
LightSweepSettings LightSweepSettingsFor(const DeviceInfo& device);

// As FitLight. `buffers` are those of `particles`. ResourceExhausted where the device's buffers are
// too small; then FitLight serves. Cancelled when `stop` says so, between runs. Needs a current
// context.
absl::StatusOr<DeviceLightFit> FitLightOnDevice(Gpu& gpu, const Light& light,
                                                const ParticleView& particles,
                                                const ParticleBuffers& buffers, Profile profile,
                                                int light_buffer_size, int degree,
                                                const std::stop_token& stop,
                                                const LightSweepSettings& settings = {});

// The optical depth behind all particles, as LightFit has it: what `image` becomes once what
// `readback` reads has arrived.
void ReadOpticalDepth(const DeviceLightFit& fit, Readback& readback, Image& image);

}  // namespace halflight::sweep
