#include "renderer/passes/light_buffer.h"

#include <algorithm>
#include <array>

#include "renderer/blur_kernel.h"
#include "renderer/gl/debug.h"
#include "shaders/bindings.h"
#include "spirv/blur.frag.h"
#include "spirv/deposit.frag.h"
#include "spirv/deposit.vert.h"
#include "spirv/fullscreen.vert.h"

namespace halflight {

namespace {

const gl::ProgramSource& DepositProgram() {
  static const gl::ProgramSource source{
      "deposit",
      {{GL_VERTEX_SHADER, spirv_deposit_vert}, {GL_FRAGMENT_SHADER, spirv_deposit_frag}}};
  return source;
}

const gl::ProgramSource& BlurProgram() {
  static const gl::ProgramSource source{
      "blur", {{GL_VERTEX_SHADER, spirv_fullscreen_vert}, {GL_FRAGMENT_SHADER, spirv_blur_frag}}};
  return source;
}

// One pass of the kernel of `variance`, taking every stride-th texel along `axis`.
absl::Status BlurOnce(Gpu& gpu, const LightBuffer& from, const LightBuffer& to,
                      const glm::uvec2& axis, uint32_t stride, const glm::dvec3& variance,
                      const glm::vec3& density, const LightChannels& channels) {
  const absl::StatusOr<GLuint> program =
      gpu.programs.Get(BlurProgram(), {{shader::kColoredLightBufferConstant, channels.colored},
                                       {shader::kUnscatteredLightConstant, channels.unscattered}});
  if (!program.ok()) return program.status();
  shader::BlurBlock block{};
  size_t radius = 0;
  for (glm::length_t c = 0; c < (channels.colored ? 3 : 1); ++c) {
    const std::vector<float> weights = DiscreteGaussian(variance[c]);
    for (size_t n = 0; n < weights.size(); ++n) block.weights[n][c] = weights[n];
    radius = std::max(radius, weights.size() - 1);
  }
  block.axis = {axis * stride, radius, 0U};
  block.density = glm::vec4(density, 0.0F);
  const gl::Buffer uniforms = gl::MakeBlock("blur", block);

  glBindFramebuffer(GL_FRAMEBUFFER, to.framebuffer.name());
  glViewport(0, 0, to.texture.width(), to.texture.height());
  glDisable(GL_BLEND);
  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kBlurBinding, uniforms.name());
  glBindTextureUnit(shader::kSourceBinding, from.texture.name());
  DrawFullscreen(gpu);
  return absl::OkStatus();
}

// Blurs `buffer` along one axis.
absl::Status BlurAlongAxis(Gpu& gpu, LightBuffer& buffer, LightBuffer& scratch,
                           const glm::uvec2& axis, const glm::dvec3& variance,
                           const glm::vec3& density, const LightChannels& channels) {
  for (const BlurStep& step :
       BlurSteps(channels.colored ? variance : glm::dvec3(variance.r), buffer.texture.width())) {
    if (absl::Status status =
            BlurOnce(gpu, buffer, scratch, axis, step.stride, step.variance, density, channels);
        !status.ok()) {
      return status;
    }
    std::swap(buffer, scratch);
  }
  return absl::OkStatus();
}

}  // namespace

LightBuffer MakeLightBuffer(const char* label, int size, const LightChannels& channels) {
  LightBuffer buffer;
  // Three channels live in four, the last of them for the unscattered light: drawing into RGB32F is
  // not required of drivers.
  GLenum format = channels.unscattered ? GL_RG32F : GL_R32F;
  if (channels.colored) format = GL_RGBA32F;
  buffer.texture = gl::Texture({.label = label, .format = format, .width = size, .height = size});
  buffer.framebuffer = gl::MakeFramebuffer(label, {&buffer.texture});
  constexpr std::array<float, 4> kZero = {};
  glClearNamedFramebufferfv(buffer.framebuffer.name(), GL_COLOR, 0, kZero.data());
  return buffer;
}

absl::Status DepositSlice(Gpu& gpu, const gl::Buffer& light_splats, const TargetProjection& light,
                          Profile profile, const LightChannels& channels, uint32_t begin,
                          uint32_t end, const LightBuffer& target) {
  const gl::DebugScope scope("deposit slice into light buffer");
  const absl::StatusOr<GLuint> program = gpu.programs.Get(
      DepositProgram(), {
                            {shader::kOrthographicConstant, light.projection.orthographic},
                            {shader::kBallProfileConstant, profile == Profile::kBall},
                            {shader::kColoredLightBufferConstant, channels.colored},
                            {shader::kUnscatteredLightConstant, channels.unscattered},
                        });
  if (!program.ok()) return program.status();
  glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer.name());
  glViewport(0, 0, target.texture.width(), target.texture.height());
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_ONE, GL_ONE);
  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, light.block.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kLightSplatsBinding, light_splats.name());
  DrawQuads(gpu, begin, end);
  return absl::OkStatus();
}

void CopyLightBuffer(const LightBuffer& from, const LightBuffer& to) {
  glCopyImageSubData(from.texture.name(), GL_TEXTURE_2D, 0, 0, 0, 0, to.texture.name(),
                     GL_TEXTURE_2D, 0, 0, 0, 0, from.texture.width(), from.texture.height(), 1);
}

absl::Status BlurLightBuffer(Gpu& gpu, LightBuffer& buffer, LightBuffer& scratch,
                             const BlurVariance& variance, const glm::vec3& density,
                             const LightChannels& channels) {
  const gl::DebugScope scope("blur light buffer");
  absl::Status status = BlurAlongAxis(gpu, buffer, scratch, {1, 0}, variance.x, density, channels);
  if (!status.ok()) return status;
  return BlurAlongAxis(gpu, buffer, scratch, {0, 1}, variance.y, density, channels);
}

}  // namespace halflight
