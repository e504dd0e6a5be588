#include "renderer/passes/light_layers.h"

#include <algorithm>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "shaders/bindings.h"
#include "spirv/deposit_slices.comp.h"

namespace halflight {

namespace {

const gl::ProgramSource& DepositSlicesProgram() {
  static const gl::ProgramSource source{"deposit slices",
                                        {{GL_COMPUTE_SHADER, spirv_deposit_slices_comp}}};
  return source;
}

size_t MostLayers() {
  GLint layers = 0;
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &layers);
  return static_cast<size_t>(layers);
}

}  // namespace

LightLayers MakeLightLayers(int size, const LightChannels& channels, size_t step, size_t slices,
                            size_t most_bytes) {
  const size_t texels = static_cast<size_t>(size) * static_cast<size_t>(size);
  const size_t layer_bytes = texels * (channels.colored ? 4 : 1) * sizeof(float);
  const size_t most = std::min(most_bytes / layer_bytes, MostLayers());
  LightLayers layers;
  layers.step = step;
  layers.slices = std::clamp<size_t>((std::max<size_t>(most, 1) - 1) / step, 1, slices);
  layers.texture = gl::Texture({.label = "light layers",
                                .format = channels.colored ? GLenum{GL_RGBA32F} : GLenum{GL_R32F},
                                .width = size,
                                .height = size,
                                .layers = static_cast<int>(layers.slices * step + 1)});
  return layers;
}

size_t MostPlacesOfDeposit(const sweep::TileWalk& walk) {
  // Beside the places, an invocation loops over chunks, slices that begin, and two searches.
  constexpr size_t kOthers = 4096;
  return walk.most_iterations / (shader::kSliceChunk + 1) * shader::kSliceChunk - kOthers;
}

absl::Status DepositPlaces(Gpu& gpu, const DepositPass& pass, const sweep::DeviceTiles& tiles,
                           const sweep::PlaceRun& places, const SliceRun& slices,
                           size_t first_slice, const LightBuffer& from, const LightBuffer& to,
                           const LightLayers& layers) {
  const gl::DebugScope scope("deposit slices into light buffer");
  const absl::StatusOr<GLuint> program = gpu.programs.Get(
      DepositSlicesProgram(),
      {
          {shader::kOrthographicConstant, pass.light.projection.orthographic},
          {shader::kBallProfileConstant, pass.profile == Profile::kBall},
          {shader::kColoredLightBufferConstant, pass.channels.colored},
          {shader::kUnscatteredLightConstant, pass.channels.unscattered},
          {shader::kLightTileSizeConstant, static_cast<uint32_t>(pass.walk.tile_size)},
      });
  if (!program.ok()) return program.status();
  shader::SliceWalkBlock block{};
  block.slices = {slices.first, slices.end, layers.step, 0U};
  block.window = {places.first, places.end, first_slice, 0U};
  const gl::Buffer uniforms = gl::MakeBlock("walk over slices", block);
  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, pass.light.block.name());
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kSliceWalkBinding, uniforms.name());
  gl::BindStorage(shader::kLightSplatsBinding, pass.splats);
  gl::BindStorage(shader::kSliceTileBeginBinding, tiles.begin);
  gl::BindStorage(shader::kSliceTileEntriesBinding, tiles.entries);
  gl::BindStorage(shader::kSliceBeginsBinding, pass.slice_begins);
  glBindTextureUnit(shader::kSourceBinding, from.texture.name());
  const auto bind_image = [&](GLuint binding, const gl::Texture& texture, GLenum format) {
    glBindImageTexture(binding, texture.name(), 0, GL_TRUE, 0, GL_WRITE_ONLY, format);
  };
  GLenum format = pass.channels.unscattered ? GL_RG32F : GL_R32F;
  if (pass.channels.colored) format = GL_RGBA32F;
  bind_image(shader::kLightTargetBinding, to.texture, format);
  bind_image(shader::kLayersTargetBinding, layers.texture,
             pass.channels.colored ? GL_RGBA32F : GL_R32F);
  glDispatchCompute(static_cast<GLuint>(tiles.tiles.x), static_cast<GLuint>(tiles.tiles.y), 1);
  // What reads them next: this pass, the composite and blur as textures, and readback.
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                  GL_TEXTURE_UPDATE_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT);
  return absl::OkStatus();
}

}  // namespace halflight
