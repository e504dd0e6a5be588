#include "renderer/sweep/device/shading.h"

#include <algorithm>

#include <glm/matrix.hpp>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "renderer/radiance.h"
#include "shaders/bindings.h"
#include "spirv/shade_light.comp.h"
#include "spirv/shade_sprites.comp.h"

namespace halflight::sweep {

namespace {

static_assert(kMaxTileLights <= shader::kMaxLightsInTiles);

const gl::ProgramSource& ShadeSpritesProgram() {
  static const gl::ProgramSource source{"shade sprites",
                                        {{GL_COMPUTE_SHADER, spirv_shade_sprites_comp}}};
  return source;
}

const gl::ProgramSource& ShadeLightProgram() {
  static const gl::ProgramSource source{"shade light",
                                        {{GL_COMPUTE_SHADER, spirv_shade_light_comp}}};
  return source;
}

// What both passes read and write.
struct ShadePass {
  Gpu& gpu;
  const ParticleBuffers& particles;
  const TargetProjection& eye;
  const DeviceSprites& sprites;
  const gl::StorageRange& places;
  gl::Constants constants;
};

shader::ShadeBlock DescribeMaterial(const Material& material, const gl::StorageRange& places) {
  shader::ShadeBlock block{};
  block.albedo = glm::vec4(material.albedo, material.phase_g);
  block.emission = glm::vec4(material.emission, 0.0F);
  block.range.x = static_cast<uint32_t>(places.count);
  return block;
}

// Shades with `program` into `out`, whose records by place are of `out_bytes`. What the pass alone
// reads is bound already.
void Shade(const ShadePass& pass, GLuint program, const shader::ShadeBlock& block,
           const gl::Buffer& out) {
  const gl::Buffer uniforms = gl::MakeBlock("shade", block);
  glUseProgram(program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, pass.eye.block.name());
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kParticlesBinding, pass.particles.uniforms.name());
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kShadeBinding, uniforms.name());
  gl::BindStorage(shader::kPositionsBinding, pass.particles.positions);
  gl::BindStorage(shader::kRadiiBinding, pass.particles.radii);
  gl::BindStorage(shader::kEyeParticlesBinding, pass.sprites.particles, sizeof(uint32_t),
                  pass.places);
  gl::BindStorage(shader::kEyeSpritesBinding, pass.sprites.sprites, sizeof(glm::vec4), pass.places);
  if (pass.sprites.has_near) {
    gl::BindStorage(shader::kEyeNearBinding, pass.sprites.near, sizeof(glm::vec4), pass.places);
  }
  gl::BindStorage(shader::kShadedBinding, out);
  gl::DispatchGroups(gl::DivideUp(pass.places.count, shader::kShadeGroupSize));
}

absl::Status ShadeHeads(const ShadePass& pass, const Scene& scene, const gl::Buffer& heads) {
  const gl::DebugScope scope("shade sprites");
  gl::Constants constants = pass.constants;
  constants[shader::kHasColorsConstant] = pass.particles.has_colors;
  constants[shader::kHasEmissionsConstant] = pass.particles.has_emissions;
  const absl::StatusOr<GLuint> program = pass.gpu.programs.Get(ShadeSpritesProgram(), constants);
  if (!program.ok()) return program.status();
  shader::ShadeBlock block = DescribeMaterial(scene.material, pass.places);
  block.constant_light = glm::vec4(ConstantLight(scene), 0.0F);
  gl::BindStorage(shader::kColorsBinding, pass.particles.colors);
  gl::BindStorage(shader::kEmissionsBinding, pass.particles.emissions);
  Shade(pass, *program, block, heads);
  return absl::OkStatus();
}

absl::Status ShadeLight(const ShadePass& pass, const Scene& scene, const ShadedLayout& layout,
                        size_t slot, const DeviceLightFit* fit, const gl::Buffer& records) {
  const gl::DebugScope scope("shade light");
  const TileLight& light = layout.lights[slot];
  const Light& source = scene.lights[static_cast<size_t>(light.light)];
  gl::Constants constants = pass.constants;
  constants[shader::kShadowedConstant] = light.shadowed;
  constants[shader::kPointShadowLightConstant] = light.shadowed && !fit->projection.orthographic;
  constants[shader::kVaryingLightsConstant] = light.varies;
  constants[shader::kPhaseConstant] = scene.material.phase_g != 0.0F;
  const absl::StatusOr<GLuint> program = pass.gpu.programs.Get(ShadeLightProgram(), constants);
  if (!program.ok()) return program.status();

  const glm::dmat4& view_from_world = pass.eye.projection.view_from_world;
  shader::ShadeBlock block = DescribeMaterial(scene.material, pass.places);
  block.light = DescribeLight(source, view_from_world);
  block.range.y = static_cast<uint32_t>(slot);
  block.range.z = static_cast<uint32_t>(layout.lights.size());
  if (light.shadowed) {
    block.light_view_from_view = glm::mat4(glm::mat3(glm::dmat3(fit->projection.view_from_world) *
                                                     glm::transpose(glm::dmat3(view_from_world))));
    block.density = glm::vec4(source.shadow_density, 0.0F);
    gl::BindStorage(shader::kFitDepthBinding, fit->depth);
    gl::BindStorage(shader::kFitSpritesBinding, fit->sprites);
  }
  Shade(pass, *program, block, records);
  return absl::OkStatus();
}

size_t Exponents(const ShadedLayout& layout) { return layout.colored_density ? 3 : 1; }

// That every buffer which is seen whole can be.
absl::Status CheckBlocks(const ParticleBuffers& particles, const ShadedLayout& layout,
                         const gl::StorageRange& places) {
  const auto terms = static_cast<size_t>(Terms(layout.degree));
  const size_t bytes[] = {particles.count * 3 * sizeof(float), particles.count * sizeof(glm::vec4),
                          particles.count * terms * sizeof(float)};
  const char* const names[] = {"particle positions", "the light's sprites", "the light's fit"};
  for (size_t i = 0; i < std::size(bytes); ++i) {
    if (absl::Status status = gl::CheckStorageBlock(names[i], bytes[i]); !status.ok()) {
      return status;
    }
  }
  const size_t most = std::max(layout.head_bytes(), layout.lights.size() * layout.record_bytes());
  return gl::CheckStorageBlock("particles in the light", places.count * most);
}

}  // namespace

size_t ShadedLayout::head_bytes() const { return (has_depth ? 4 : 3) * sizeof(glm::vec4); }

size_t ShadedLayout::record_bytes() const {
  return (1 + Exponents(*this) * static_cast<size_t>(Terms(degree)) + (has_near ? 6 : 0)) *
         sizeof(float);
}

gl::Constants ShadedLayout::constants() const {
  return {{shader::kNearEyeConstant, has_near},
          {shader::kDepthOutputConstant, has_depth},
          {shader::kColoredDensityConstant, colored_density},
          {shader::kFitDegreeConstant, static_cast<uint32_t>(degree)}};
}

ShadedLayout LayOutShading(const Scene& scene, const DeviceSprites& sprites, int degree,
                           bool keep_depth, bool keep_transmittance) {
  ShadedLayout layout;
  layout.lights = ListTileLights(scene, keep_transmittance);
  layout.degree = degree;
  layout.colored_density = std::any_of(scene.lights.begin(), scene.lights.end(),
                                       [](const Light& light) { return light.colored_density(); });
  layout.has_near = sprites.has_near;
  layout.has_depth = keep_depth;
  return layout;
}

size_t MostShadedPlaces(const ShadedLayout& layout, size_t most_bytes) {
  const size_t place = std::max(layout.head_bytes(), layout.lights.size() * layout.record_bytes());
  return std::max<size_t>(most_bytes / place / kShadedAlignment, 1) * kShadedAlignment;
}

absl::StatusOr<ShadedPlaces> ShadePlaces(Gpu& gpu, const Scene& scene,
                                         const ParticleBuffers& particles,
                                         const TargetProjection& eye, const DeviceSprites& sprites,
                                         const std::vector<const DeviceLightFit*>& fits,
                                         const ShadedLayout& layout, const PlaceRun& run) {
  const gl::StorageRange places{run.first, run.end - run.first};
  if (absl::Status status = CheckBlocks(particles, layout, places); !status.ok()) return status;
  ShadedPlaces shaded;
  shaded.run = run;
  shaded.heads = gl::MakeBuffer("particle heads", places.count * layout.head_bytes());
  shaded.records = gl::MakeBuffer("particles in the light",
                                  places.count * layout.lights.size() * layout.record_bytes());
  if (places.count == 0) return shaded;

  ShadePass pass{gpu, particles, eye, sprites, places, layout.constants()};
  pass.constants[shader::kOrthographicConstant] = eye.projection.orthographic;
  pass.constants[shader::kHasRadiiConstant] = particles.has_radii;
  if (absl::Status status = ShadeHeads(pass, scene, shaded.heads); !status.ok()) return status;
  for (size_t slot = 0; slot < layout.lights.size(); ++slot) {
    const auto light = static_cast<size_t>(layout.lights[slot].light);
    absl::Status status = ShadeLight(pass, scene, layout, slot, fits[light], shaded.records);
    if (!status.ok()) return status;
  }
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  return shaded;
}

}  // namespace halflight::sweep
