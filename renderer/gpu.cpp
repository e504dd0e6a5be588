#include "renderer/gpu.h"

#include <algorithm>
#include <utility>

#include "renderer/gl/debug.h"

namespace halflight {

namespace {

// Quads of one draw call: their indices take 1.5 MiB, once for all orders.
constexpr uint32_t kMaxQuads = 1U << 16U;

std::vector<uint32_t> QuadIndices() {
  std::vector<uint32_t> indices;
  indices.reserve(size_t{6} * kMaxQuads);
  for (uint32_t k = 0; k < kMaxQuads; ++k) {
    for (const uint32_t corner : {0U, 1U, 2U, 2U, 1U, 3U}) indices.push_back(4 * k + corner);
  }
  return indices;
}

struct ParticleBuffersKey {
  using Value = ParticleBuffers;
  ParticleViewKey particles;

  bool operator==(const ParticleBuffersKey&) const = default;
};

// What OrderParticles depends on. `eye` only without an axis.
struct DeviceOrderKey {
  using Value = DeviceOrder;
  ParticleViewKey particles;
  std::optional<glm::dvec3> axis;
  glm::dvec3 eye{0.0};
  int slices = 1;
  SliceSpacing spacing = SliceSpacing::kEqualCount;

  bool operator==(const DeviceOrderKey&) const = default;
};

}  // namespace

Gpu::Gpu() : quad_indices(gl::MakeBuffer("quad indices", QuadIndices())) {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  no_vertices = gl::VertexArray(name);
  glVertexArrayElementBuffer(name, quad_indices.name());
}

size_t ParticleBuffers::bytes() const {
  const size_t floats = 3 + (has_radii ? 1 : 0) + (has_optical_depths ? 1 : 0) +
                        (has_colors ? 3 : 0) + (has_emissions ? 3 : 0);
  return count * floats * sizeof(float);
}

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

absl::StatusOr<std::shared_ptr<const ParticleBuffers>> ParticlesOnDevice(
    FrameCache& cache, const Scene& scene, const ParticleView& particles) {
  return cache.FindOrMake(scene.particles, ParticleBuffersKey{ParticleViewKeyOf(scene)},
                          [&]() -> absl::StatusOr<ParticleBuffers> {
                            ParticleBuffers buffers = UploadParticles(particles);
                            // What did not fit must not be found again.
                            absl::Status status = gl::CheckErrors("particles");
                            if (!status.ok()) return status;
                            return buffers;
                          });
}

size_t DeviceOrder::bytes() const {
  return count() * sizeof(shader::OrderedParticle) + slice_begin.capacity() * sizeof(uint32_t) +
         slice_position.capacity() * sizeof(double);
}

absl::StatusOr<std::shared_ptr<const DeviceOrder>> OrderOnDevice(
    FrameCache& cache, const Scene& scene, const ParticleView& particles,
    const Traversal& traversal, const glm::dvec3& eye, bool& made) {
  const DeviceOrderKey key{ParticleViewKeyOf(scene), traversal.axis,
                           traversal.axis ? glm::dvec3(0.0) : eye, traversal.slices,
                           traversal.spacing};
  made = false;
  return cache.FindOrMake(scene.particles, key, [&]() -> absl::StatusOr<DeviceOrder> {
    made = true;
    ParticleOrder order = OrderParticles(particles, traversal, eye);
    DeviceOrder device{gl::MakeBuffer("order", order.particles), std::move(order.slice_begin),
                       std::move(order.slice_position), order.end_position};
    absl::Status status = gl::CheckErrors("order");
    if (!status.ok()) return status;
    return device;
  });
}

void DrawQuads(const Gpu& gpu, uint32_t begin, uint32_t end) {
  glBindVertexArray(gpu.no_vertices.name());
  for (uint32_t first = begin; first < end; first += kMaxQuads) {
    const uint32_t quads = std::min(kMaxQuads, end - first);
    glDrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(6 * quads), GL_UNSIGNED_INT,
                             nullptr, static_cast<GLint>(4 * first));
  }
}

void DrawFullscreen(const Gpu& gpu) {
  glBindVertexArray(gpu.no_vertices.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace halflight
