#include "renderer/passes/project.h"

#include "renderer/gl/debug.h"
#include "shaders/bindings.h"
#include "spirv/project.comp.h"

namespace halflight {

namespace {

const gl::ProgramSource& ProjectProgram() {
  static const gl::ProgramSource source{"project", {{GL_COMPUTE_SHADER, spirv_project_comp}}};
  return source;
}

}  // namespace

TargetProjection UploadProjection(const Projection& projection, const ParticleView& particles) {
  return {projection, gl::MakeBlock("projection", projection.block(particles))};
}

absl::StatusOr<gl::Buffer> ProjectParticles(Gpu& gpu, const ParticleBuffers& particles,
                                            const DeviceOrder& order,
                                            const TargetProjection& target, const char* label) {
  const gl::DebugScope scope(label);
  const absl::StatusOr<GLuint> program = gpu.programs.Get(
      ProjectProgram(), {
                            {shader::kOrthographicConstant, target.projection.orthographic},
                            {shader::kHasRadiiConstant, particles.has_radii},
                            {shader::kHasOpticalDepthsConstant, particles.has_optical_depths},
                        });
  if (!program.ok()) return program.status();
  gl::Buffer splats = gl::MakeBuffer(label, particles.count * sizeof(shader::Splat));
  if (particles.count == 0) return splats;

  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, target.block.name());
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kParticlesBinding, particles.uniforms.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kOrderBinding, order.places.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kPositionsBinding, particles.positions.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kRadiiBinding, particles.radii.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kOpticalDepthsBinding,
                   particles.optical_depths.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kSplatsBinding, splats.name());
  const auto groups = static_cast<GLuint>((particles.count + shader::kProjectGroupSize - 1) /
                                          shader::kProjectGroupSize);
  // GL guarantees so many groups along an axis; the shader counts rows of them.
  constexpr GLuint kMostAcross = 65535;
  const GLuint rows = (groups + kMostAcross - 1) / kMostAcross;
  glDispatchCompute((groups + rows - 1) / rows, rows, 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  return splats;
}

}  // namespace halflight
