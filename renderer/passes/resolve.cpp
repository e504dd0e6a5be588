#include "renderer/passes/resolve.h"

#include "renderer/gl/debug.h"
#include "shaders/bindings.h"
#include "spirv/fullscreen.vert.h"
#include "spirv/resolve.frag.h"

namespace halflight {

namespace {

const gl::ProgramSource& ResolveProgram() {
  static const gl::ProgramSource source{
      "resolve",
      {{GL_VERTEX_SHADER, spirv_fullscreen_vert}, {GL_FRAGMENT_SHADER, spirv_resolve_frag}}};
  return source;
}

}  // namespace

absl::StatusOr<gl::Texture> ResolveSamples(Gpu& gpu, const gl::Texture& samples,
                                           const Sampling& sampling, const Band& band,
                                           const glm::ivec2& composite_size) {
  const gl::DebugScope scope("resolve samples");
  const bool enlarge = sampling.downsample > 1;
  const absl::StatusOr<GLuint> program =
      gpu.programs.Get(ResolveProgram(), {{shader::kEnlargeConstant, enlarge}});
  if (!program.ok()) return program.status();
  gl::Texture pixels({.label = "resolved",
                      .format = GL_RGBA32F,
                      .width = band.pixels.width,
                      .height = band.pixels.height});
  const gl::Framebuffer framebuffer = gl::MakeFramebuffer("resolve", {&pixels});
  shader::ResolveBlock block{};
  block.factor.x = enlarge ? sampling.downsample : sampling.supersample;
  block.first = {band.pixels.x, band.pixels.y, band.samples.x, band.samples.y};
  block.size = {composite_size, 0, 0};
  const gl::Buffer uniforms = gl::MakeBlock("resolve", block);

  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  glViewport(0, 0, pixels.width(), pixels.height());
  glDisable(GL_BLEND);
  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kResolveBinding, uniforms.name());
  glBindTextureUnit(shader::kSourceBinding, samples.name());
  DrawFullscreen(gpu);
  return pixels;
}

}  // namespace halflight
