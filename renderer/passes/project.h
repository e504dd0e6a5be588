// Projects a traversal's particles onto the eye's or a light's target.
#pragma once

#include "absl/status/statusor.h"
#include "renderer/gpu.h"
#include "renderer/projection.h"

namespace halflight {

// A projection with its uniform block on the device.
struct TargetProjection {
  Projection projection;
  gl::Buffer block;  // shader::ProjectionBlock
};

TargetProjection UploadProjection(const Projection& projection, const ParticleView& particles);

// Returns shader::Splat[], one for each place of the order.
absl::StatusOr<gl::Buffer> ProjectParticles(Gpu& gpu, const ParticleBuffers& particles,
                                            const DeviceOrder& order,
                                            const TargetProjection& target, const char* label);

}  // namespace halflight
