#include "renderer/passes/composite_slices.h"

#include <algorithm>
#include <bit>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "shaders/bindings.h"
#include "spirv/composite_slices.comp.h"

namespace halflight {

namespace {

const gl::ProgramSource& CompositeSlicesProgram() {
  static const gl::ProgramSource source{"composite slices",
                                        {{GL_COMPUTE_SHADER, spirv_composite_slices_comp}}};
  return source;
}

// Entries of a tile's list that one dispatch may take.
size_t MostEntries(const CompositePass& pass, const LayeredLight* light,
                   const sweep::TileWalk& walk) {
  const auto invocations = static_cast<size_t>(walk.tile_size) * walk.tile_size;
  const size_t slices = light != nullptr ? light->run.end - light->run.first : 1;
  const size_t loads =
      gl::DivideUp(shader::kSliceChunk, invocations) * (1 + std::bit_width(slices));
  const size_t lights = pass.constants.at(shader::kVaryingLightsConstant);
  const size_t chunk = 1 + loads + shader::kSliceChunk * (1 + lights);
  return std::max<size_t>(walk.most_iterations / chunk, 1) * shader::kSliceChunk;
}

void BindImage(GLuint binding, const gl::Texture& texture) {
  if (!texture) return;
  glBindImageTexture(binding, texture.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
}

void Bind(const CompositePass& pass, const sweep::DeviceTiles& tiles, const LayeredLight* light,
          const CompositeTarget& target) {
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kCompositeBinding, pass.uniforms.name());
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, target.projection.name());
  gl::BindStorage(shader::kOrderBinding, pass.order.places);
  gl::BindStorage(shader::kColorsBinding, pass.particles.colors);
  gl::BindStorage(shader::kEmissionsBinding, pass.particles.emissions);
  gl::BindStorage(shader::kSplatsBinding, pass.eye_splats);
  gl::BindStorage(shader::kSliceTileBeginBinding, tiles.begin);
  gl::BindStorage(shader::kSliceTileEntriesBinding, tiles.entries);
  if (light != nullptr) {
    gl::BindStorage(shader::kLightSplatsBinding, *pass.light_splats);
    gl::BindStorage(shader::kSliceBeginsBinding, light->slice_begins);
    glBindTextureUnit(shader::kLightLayersBinding, light->layers.texture.name());
  }
  BindImage(shader::kTileTargetBinding, target.image);
  BindImage(shader::kDepthTargetBinding, target.depth);
  BindImage(shader::kTransmittanceTargetBinding, target.transmittance);
}

}  // namespace

absl::Status CompositeSlices(Gpu& gpu, const CompositePass& pass, const sweep::DeviceTiles& tiles,
                             const sweep::PlaceRun& places, const LayeredLight* light,
                             const sweep::TileWalk& walk, const CompositeTarget& target,
                             const std::stop_token& stop) {
  const gl::DebugScope scope("composite slices");
  gl::Constants constants = pass.constants;
  constants[shader::kTileColumnsConstant] = static_cast<uint32_t>(walk.tile_size);
  constants[shader::kTileRowsConstant] = static_cast<uint32_t>(walk.tile_size);
  constants[shader::kBackToFrontConstant] = pass.back_to_front;
  const absl::StatusOr<GLuint> program = gpu.programs.Get(CompositeSlicesProgram(), constants);
  if (!program.ok()) return program.status();
  glUseProgram(*program);
  Bind(pass, tiles, light, target);

  shader::SliceWalkBlock block{};
  if (light != nullptr) block.slices = {light->run.first, light->run.end, light->layers.step, 0U};
  // No list is longer.
  const size_t longest = std::min(places.end - places.first, tiles.entry_count);
  const size_t step = MostEntries(pass, light, walk);
  for (size_t first = 0; first < longest; first += step) {
    if (stop.stop_requested()) return absl::CancelledError("frame cancelled");
    block.window = {first, step, 0U, 0U};
    const gl::Buffer uniforms = gl::MakeBlock("walk over slices", block);
    glBindBufferBase(GL_UNIFORM_BUFFER, shader::kSliceWalkBinding, uniforms.name());
    glDispatchCompute(static_cast<GLuint>(tiles.tiles.x), static_cast<GLuint>(tiles.tiles.y), 1);
    glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  }
  // What reads the targets next.
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                  GL_FRAMEBUFFER_BARRIER_BIT);
  return absl::OkStatus();
}

}  // namespace halflight
