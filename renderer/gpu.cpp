#include "renderer/gpu.h"

#include <algorithm>

namespace halflight {

ParticleBuffers UploadParticles(const ParticleView& particles) {
  const ParticleSet& set = particles.set();
  ParticleBuffers buffers;
  buffers.count = particles.size();
  buffers.has_radii = !set.radii.empty();
  buffers.has_optical_depths = !particles.optical_depths().empty();
  buffers.has_colors = !set.colors.empty();
  buffers.has_emissions = !set.emissions.empty();
  shader::ParticlesBlock block;
  block.uniforms = {particles.uniform_radius(), particles.uniform_optical_depth(), 0.0F, 0.0F};
  block.count = {static_cast<uint32_t>(particles.size()), 0U, 0U, 0U};
  buffers.uniforms = gl::MakeBlock("particle uniforms", block);
  buffers.positions = gl::MakeBuffer("positions", particles.positions());
  buffers.radii = gl::MakeBuffer("radii", set.radii);
  buffers.optical_depths = gl::MakeBuffer("optical depths", particles.optical_depths());
  buffers.colors = gl::MakeBuffer("colors", set.colors);
  buffers.emissions = gl::MakeBuffer("emissions", set.emissions);
  return buffers;
}

OrderBuffers UploadOrder(const ParticleOrder& order) {
  uint32_t largest_slice = 0;
  for (size_t s = 0; s + 1 < order.slice_begin.size(); ++s) {
    largest_slice = std::max(largest_slice, order.slice_begin[s + 1] - order.slice_begin[s]);
  }
  std::vector<uint32_t> indices;
  indices.reserve(size_t{6} * largest_slice);
  for (uint32_t k = 0; k < largest_slice; ++k) {
    for (const uint32_t corner : {0U, 1U, 2U, 2U, 1U, 3U}) indices.push_back(4 * k + corner);
  }
  return {gl::MakeBuffer("order", order.particles), gl::MakeBuffer("quad indices", indices)};
}

void DrawQuads(const Gpu& gpu, const OrderBuffers& order, uint32_t begin, uint32_t end) {
  if (begin == end) return;
  glVertexArrayElementBuffer(gpu.no_vertices.name(), order.quad_indices.name());
  glBindVertexArray(gpu.no_vertices.name());
  glDrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(6 * (end - begin)), GL_UNSIGNED_INT,
                           nullptr, static_cast<GLint>(4 * begin));
}

void DrawFullscreen(const Gpu& gpu) {
  glBindVertexArray(gpu.no_vertices.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace halflight
