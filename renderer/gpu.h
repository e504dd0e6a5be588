// What lives on the device between frames: programs, particles, and orders of particles.
#pragma once

#include <epoxy/gl.h>

#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame_cache.h"
#include "renderer/gl/object.h"
#include "renderer/gl/program.h"
#include "renderer/particle_order.h"
#include "renderer/particle_view.h"

namespace halflight {

// Needs the context that it was made with current.
struct Gpu {
  gl::ProgramCache programs;
  gl::VertexArray no_vertices;  // all vertices are computed from gl_VertexID
  gl::Buffer quad_indices;      // two triangles a quad, of four vertices each, from vertex 0 on

  Gpu();
};

// A frame's particles in the set's own order; attributes that the set lacks stay empty buffers.
struct ParticleBuffers {
  size_t count = 0;
  bool has_radii = false;
  bool has_optical_depths = false;
  bool has_colors = false;
  bool has_emissions = false;
  gl::Buffer uniforms;  // shader::ParticlesBlock
  gl::Buffer positions;
  gl::Buffer radii;
  gl::Buffer optical_depths;
  gl::Buffer colors;
  gl::Buffer emissions;

  // On the device.
  [[nodiscard]] size_t bytes() const;
};

ParticleBuffers UploadParticles(const ParticleView& particles);

// The same, resident on the device from frame to frame as far as `cache` has room. `particles` is
// the view of the scene. ResourceExhausted when the device is out of memory.
absl::StatusOr<std::shared_ptr<const ParticleBuffers>> ParticlesOnDevice(
    FrameCache& cache, const Scene& scene, const ParticleView& particles);

// A traversal's order on the device; without the particles that ParticleOrder has in main memory.
struct DeviceOrder {
  gl::Buffer places;  // shader::OrderedParticle[]
  // As in ParticleOrder.
  std::vector<uint32_t> slice_begin;
  std::vector<double> slice_position;
  double end_position = 0.0;

  [[nodiscard]] uint32_t count() const { return slice_begin.back(); }
  [[nodiscard]] size_t bytes() const;
};

// The order of OrderParticles, resident as the particles are. `made` tells whether it was made now.
absl::StatusOr<std::shared_ptr<const DeviceOrder>> OrderOnDevice(FrameCache& cache,
                                                                 const Scene& scene,
                                                                 const ParticleView& particles,
                                                                 const Traversal& traversal,
                                                                 const glm::dvec3& eye, bool& made);

// Draws particles [begin, end) of an order as quads of four vertices, numbered 4 k + corner.
void DrawQuads(const Gpu& gpu, uint32_t begin, uint32_t end);

// Draws one triangle over the whole target.
void DrawFullscreen(const Gpu& gpu);

}  // namespace halflight
