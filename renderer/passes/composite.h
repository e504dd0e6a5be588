// The eye pass: particles over the image, in the traversal's order.
#pragma once

#include <optional>
#include <span>

#include "absl/status/status.h"
#include "renderer/frame_plan.h"
#include "renderer/gpu.h"
#include "renderer/passes/light_buffer.h"
#include "renderer/passes/project.h"

namespace halflight {

// What a traversal draws a band of the image into; depth and transmittance only where an output
// shows them.
struct CompositeTarget {
  gl::Buffer projection;      // shader::ProjectionBlock, of the band
  gl::Texture image;          // premultiplied R G B A
  gl::Texture depth;          // depth * alpha, alpha in A
  gl::Texture transmittance;  // R G B * alpha, alpha
  gl::Framebuffer framebuffer;
};

// Holds the samples of a band of what `eye` projects onto, cleared to nothing covered.
CompositeTarget MakeCompositeTarget(const Projection& eye, const ParticleView& particles,
                                    const PixelRect& samples, bool depth, bool transmittance);

// The light buffers that a slice sees.
struct SliceLight {
  const LightBuffer& before;  // without the slice
  const LightBuffer& after;   // with it; read only when interpolating
};

// Everything about a traversal that stays the same from slice to slice.
struct CompositePass {
  const DeviceOrder& order;
  const ParticleBuffers& particles;
  const gl::Buffer& eye_splats;
  const gl::Buffer* light_splats;  // null: no shadows
  gl::Buffer uniforms;             // shader::CompositeBlock
  gl::Constants constants;
  bool back_to_front;
};

// `light` and `light_splats` are those of traversal.shadow_light, null without. `target` is one of
// those that will be drawn into, which are all alike.
CompositePass PrepareComposite(const Scene& scene, const Traversal& traversal,
                               const DeviceOrder& order, const ParticleBuffers& particles,
                               const Projection& eye, const gl::Buffer& eye_splats,
                               const TargetProjection* light, const gl::Buffer* light_splats,
                               const CompositeTarget& target);

// Draws particles [begin, end) of the order over all targets; `light` is null without shadows.
absl::Status CompositeSlice(Gpu& gpu, const CompositePass& pass, uint32_t begin, uint32_t end,
                            const SliceLight* light, std::span<const CompositeTarget> targets);

}  // namespace halflight
