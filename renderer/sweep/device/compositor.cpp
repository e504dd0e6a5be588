#include "renderer/sweep/device/compositor.h"

#include <algorithm>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "shaders/bindings.h"
#include "spirv/composite_tiles.comp.h"

namespace halflight::sweep {

namespace {

const gl::ProgramSource& CompositeTilesProgram() {
  static const gl::ProgramSource source{"composite tiles",
                                        {{GL_COMPUTE_SHADER, spirv_composite_tiles_comp}}};
  return source;
}

// What becomes an image: which slots, and of what colours.
struct Show {
  uint32_t what;  // value of kTileShowsConstant
  size_t first_slot;
  size_t slots;
  const gl::Texture& target;
};

// Particles that a workgroup loads at once, and the loops that takes one invocation.
struct Chunk {
  uint32_t particles;
  uint32_t iterations;
};

Chunk ChunkOf(const ShadedLayout& layout, size_t slots, int tile_size) {
  // Of the 32 KiB that GL grants a workgroup, so much that several fit a core of a GPU; and no more
  // particles than shall be summed on their own.
  constexpr size_t kSharedBytes = 24576;
  constexpr size_t kMost = 64;
  const size_t record_bytes = slots * layout.record_bytes();
  const size_t particles =
      std::clamp<size_t>(kSharedBytes / (layout.head_bytes() + record_bytes), 1, kMost);
  const auto invocations = static_cast<size_t>(tile_size) * static_cast<size_t>(tile_size);
  const size_t loads =
      gl::DivideUp(particles * layout.head_bytes() / sizeof(glm::vec4), invocations) +
      gl::DivideUp(particles * record_bytes / sizeof(float), invocations);
  return {static_cast<uint32_t>(particles),
          static_cast<uint32_t>(1 + loads + particles * (1 + slots))};
}

shader::TileCompositeBlock DescribeComposite(const Scene& scene, const ShadedLayout& layout,
                                             const Show& show) {
  // Light gained: so much that nothing overflows, as in renderer/sweep/simd.h.
  constexpr float kLeastExponent = -41.0F;
  shader::TileCompositeBlock block{};
  block.slots = {show.first_slot, layout.lights.size(), 0U, 0U};
  for (size_t slot = 0; slot < layout.lights.size(); ++slot) {
    const TileLight& light = layout.lights[slot];
    const glm::vec3 color = show.what == shader::kShowsTransmittance
                                ? glm::vec3(1.0F)
                                : scene.lights[static_cast<size_t>(light.light)].color;
    block.colors[slot] = glm::vec4(color, light.varies ? kLeastExponent : 0.0F);
  }
  return block;
}

}  // namespace

TileWalk TileWalkFor(const DeviceInfo& device) {
  if (device.software) return {.tile_size = 8, .most_iterations = 60000};
  return {.tile_size = 16};
}

TileTargets MakeTileTargets(const glm::ivec2& size, const ShadedLayout& layout,
                            const std::vector<int>& transmittance) {
  const auto make = [&](const char* label) {
    gl::Texture texture({.label = label, .format = GL_RGBA32F, .width = size.x, .height = size.y});
    glClearTexImage(texture.name(), 0, GL_RGBA, GL_FLOAT, nullptr);
    return texture;
  };
  TileTargets targets;
  targets.beauty = make("image");
  if (layout.has_depth) targets.depth = make("depth");
  targets.transmittance.resize(layout.lights.size());
  for (const int slot : transmittance) {
    targets.transmittance[static_cast<size_t>(slot)] = make("transmittance");
  }
  return targets;
}

absl::Status CompositePlaces(Gpu& gpu, const Scene& scene, const TargetProjection& eye,
                             const ShadedLayout& layout, const ShadedPlaces& shaded,
                             const DeviceTiles& tiles, const TileWalk& walk,
                             const TileTargets& targets, const std::stop_token& stop) {
  const gl::DebugScope scope("composite tiles");
  const auto adding = static_cast<size_t>(std::count_if(layout.lights.begin(), layout.lights.end(),
                                                        [](const TileLight& l) { return l.adds; }));
  std::vector<Show> shows = {{shader::kShowsColor, 0, adding, targets.beauty}};
  if (targets.depth) shows.push_back({shader::kShowsDepth, 0, 0, targets.depth});
  for (size_t slot = 0; slot < targets.transmittance.size(); ++slot) {
    if (!targets.transmittance[slot]) continue;
    shows.push_back({shader::kShowsTransmittance, slot, 1, targets.transmittance[slot]});
  }

  // No list is longer.
  const size_t longest = std::min(shaded.run.end - shaded.run.first, tiles.entry_count);
  for (const Show& show : shows) {
    const Chunk chunk = ChunkOf(layout, show.slots, walk.tile_size);
    gl::Constants constants = layout.constants();
    constants[shader::kOrthographicConstant] = eye.projection.orthographic;
    constants[shader::kBallProfileConstant] = scene.material.profile == Profile::kBall;
    constants[shader::kTileColumnsConstant] = static_cast<uint32_t>(walk.tile_size);
    constants[shader::kTileRowsConstant] = static_cast<uint32_t>(walk.tile_size);
    constants[shader::kTileChunkConstant] = chunk.particles;
    constants[shader::kTileLightsConstant] = static_cast<uint32_t>(show.slots);
    constants[shader::kTileShowsConstant] = show.what;
    const absl::StatusOr<GLuint> program = gpu.programs.Get(CompositeTilesProgram(), constants);
    if (!program.ok()) return program.status();

    shader::TileCompositeBlock block = DescribeComposite(scene, layout, show);
    block.tiles = {targets.first_tile, tiles.tiles.x, 0};
    const glm::ivec2 size(show.target.width(), show.target.height());
    const glm::ivec2 groups = (size + (walk.tile_size - 1)) / walk.tile_size;
    const size_t step =
        size_t{std::max(walk.most_iterations / chunk.iterations, 1U)} * chunk.particles;
    for (size_t first = 0; first < longest; first += step) {
      if (stop.stop_requested()) return absl::CancelledError("frame cancelled");
      block.walk = {first, step, shaded.run.first, 0U};
      const gl::Buffer uniforms = gl::MakeBlock("composite tiles", block);
      glUseProgram(*program);
      glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, eye.block.name());
      glBindBufferBase(GL_UNIFORM_BUFFER, shader::kTileCompositeBinding, uniforms.name());
      gl::BindStorage(shader::kTileHeadsBinding, shaded.heads);
      gl::BindStorage(shader::kTileLightsBinding, shaded.records);
      gl::BindStorage(shader::kTileBeginBinding, tiles.begin);
      gl::BindStorage(shader::kTileEntriesBinding, tiles.entries);
      glBindImageTexture(shader::kTileTargetBinding, show.target.name(), 0, GL_FALSE, 0,
                         GL_READ_WRITE, GL_RGBA32F);
      glDispatchCompute(static_cast<GLuint>(groups.x), static_cast<GLuint>(groups.y), 1);
      glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    }
  }
  // What reads the targets next.
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                  GL_FRAMEBUFFER_BARRIER_BIT);
  return absl::OkStatus();
}

}  // namespace halflight::sweep
