// Keys, their sort, and projections, in compute.
#include <algorithm>
#include <atomic>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "renderer/parallel.h"
#include "renderer/passes/sort_keys.h"
#include "renderer/sweep/device/lists.h"
#include "shaders/bindings.h"
#include "spirv/list_sprites.comp.h"
#include "spirv/sprite_keys.comp.h"

namespace halflight::sweep {

namespace {

const gl::ProgramSource& KeysProgram() {
  static const gl::ProgramSource source{"sprite keys",
                                        {{GL_COMPUTE_SHADER, spirv_sprite_keys_comp}}};
  return source;
}

const gl::ProgramSource& ListProgram() {
  static const gl::ProgramSource source{"list sprites",
                                        {{GL_COMPUTE_SHADER, spirv_list_sprites_comp}}};
  return source;
}

shader::SpriteTargetBlock BlockOf(const Projection& target, const glm::dvec3& origin,
                                  double near_depth) {
  shader::SpriteTargetBlock block{};
  for (int column = 0; column < 3; ++column) {
    block.view_from_world[column] = target.view_from_world[column];
  }
  block.origin_from_eye = glm::dvec4(origin - target.eye(), 0.0);
  block.pixel_from_plane = glm::dvec4(target.pixel_from_plane, target.pixel_offset);
  block.size = glm::dvec4(target.size, target.least_radius, 0.0);
  block.near_depths = glm::dvec4(std::max(near_depth, kLeastNearDepth), kLeastNearDepth, 0.0, 0.0);
  return block;
}

void BindParticles(const ParticleBuffers& particles) {
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kParticlesBinding, particles.uniforms.name());
  gl::BindStorage(shader::kPositionsBinding, particles.positions);
  gl::BindStorage(shader::kRadiiBinding, particles.radii);
}

// Whether any particle is near, or so nearly so that rounding may tell otherwise; as ListSprites
// has it. What most frames have none of takes no memory in them, and none waits for the device to
// tell.
bool AnyNear(const ParticleView& particles, const Projection& target, double near_depth) {
  constexpr double kSlack = 1.0 + 1e-6;
  const double depth = kSlack * std::max(near_depth, kLeastNearDepth);
  if (target.orthographic || particles.size() == 0) return false;
  const glm::dvec3 forward = -glm::dvec3(glm::row(target.view_from_world, 2));
  const glm::dvec3 origin_from_eye = particles.set().origin - target.eye();
  const double enlarged = depth * target.least_radius;  // of w: what small particles come to
  const OffsetBounds& bounds = particles.bounds();
  const double least_depth = glm::dot(forward, bounds.center() + origin_from_eye) -
                             glm::dot(glm::abs(forward), (bounds.high - bounds.low) * 0.5);
  if (enlarged < 1.0 && least_depth > depth * particles.largest_radius()) return false;

  std::atomic<bool> any = false;
  ParallelRanges(particles.size(), [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end && !any; ++i) {
      const double w = glm::dot(forward, glm::dvec3(particles.positions()[i]) + origin_from_eye);
      if (w <= depth * particles.radius(i) || (w > 0.0 && enlarged >= 1.0)) any = true;
    }
  });
  return any;
}

absl::StatusOr<gl::Buffer> MakeKeys(Gpu& gpu, const ParticleBuffers& particles,
                                    const gl::Constants& constants,
                                    const shader::SpriteTargetBlock& block) {
  const absl::StatusOr<GLuint> program = gpu.programs.Get(KeysProgram(), constants);
  if (!program.ok()) return program.status();
  gl::Buffer keys = gl::MakeBuffer("sprite keys", particles.count * sizeof(uint32_t));
  const gl::Buffer uniforms = gl::MakeBlock("sprite target", block);
  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kSpriteTargetBinding, uniforms.name());
  BindParticles(particles);
  gl::BindStorage(shader::kSpriteKeysBinding, keys);
  gl::DispatchGroups(gl::DivideUp(particles.count, shader::kListGroupSize));
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  return keys;
}

absl::Status Project(Gpu& gpu, const ParticleBuffers& particles, gl::Constants constants,
                     shader::SpriteTargetBlock block, DeviceSprites& list) {
  constants[shader::kHasOpticalDepthsConstant] = particles.has_optical_depths;
  constants[shader::kHasNearConstant] = list.has_near;
  const absl::StatusOr<GLuint> program = gpu.programs.Get(ListProgram(), constants);
  if (!program.ok()) return program.status();
  glUseProgram(*program);
  BindParticles(particles);
  gl::BindStorage(shader::kOpticalDepthsBinding, particles.optical_depths);
  // In runs of which a storage block holds all sprites; 64 places are 256 bytes of the least of
  // the lists.
  const size_t run = std::max<size_t>(gl::StorageBlockLimit() / sizeof(glm::vec4) / 64, 1) * 64;
  for (size_t first = 0; first < list.count; first += run) {
    const gl::StorageRange places{first, std::min(run, list.count - first)};
    block.run.x = static_cast<uint32_t>(places.count);
    const gl::Buffer uniforms = gl::MakeBlock("sprite target", block);
    glBindBufferBase(GL_UNIFORM_BUFFER, shader::kSpriteTargetBinding, uniforms.name());
    gl::BindStorage(shader::kSpriteOrderBinding, list.particles, sizeof(uint32_t), places);
    gl::BindStorage(shader::kSpritesBinding, list.sprites, sizeof(glm::vec4), places);
    gl::BindStorage(shader::kSpriteRectsBinding, list.rects, sizeof(glm::uvec2), places);
    if (list.has_near) {
      gl::BindStorage(shader::kNearSpritesBinding, list.near, sizeof(glm::vec4), places);
    }
    gl::DispatchGroups(gl::DivideUp(places.count, shader::kListGroupSize));
  }
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DeviceSprites> ListDeviceSprites(Gpu& gpu, const ParticleBuffers& buffers,
                                                const ParticleView& particles,
                                                const Projection& target, double near_depth) {
  const gl::DebugScope scope("list sprites");
  if (absl::Status status = gl::CheckStorageBlock("positions", buffers.count * sizeof(glm::vec3));
      !status.ok()) {
    return status;
  }
  const gl::Constants constants = {{shader::kOrthographicConstant, target.orthographic},
                                   {shader::kHasRadiiConstant, buffers.has_radii}};
  const shader::SpriteTargetBlock block = BlockOf(target, particles.set().origin, near_depth);
  absl::StatusOr<gl::Buffer> keys = MakeKeys(gpu, buffers, constants, block);
  if (!keys.ok()) return keys.status();
  absl::StatusOr<KeyedValues> sorted =
      SortKeys(gpu, {*std::move(keys), gl::Buffer()}, buffers.count);
  if (!sorted.ok()) return sorted.status();

  DeviceSprites list;
  list.count = buffers.count;
  list.particles = std::move(sorted->values);
  list.sprites = gl::MakeBuffer("sprites", list.count * sizeof(glm::vec4));
  list.rects = gl::MakeBuffer("sprite rectangles", list.count * sizeof(glm::uvec2));
  list.has_near = AnyNear(particles, target, near_depth);
  if (list.has_near) list.near = gl::MakeBuffer("near sprites", list.count * sizeof(glm::vec4));
  if (absl::Status status = Project(gpu, buffers, constants, block, list); !status.ok()) {
    return status;
  }
  return list;
}

}  // namespace halflight::sweep
