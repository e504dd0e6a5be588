#include "renderer/passes/composite.h"

#include <array>

#include <glm/matrix.hpp>

#include "renderer/gl/debug.h"
#include "renderer/radiance.h"
#include "shaders/bindings.h"
#include "spirv/composite.frag.h"
#include "spirv/composite.vert.h"

namespace halflight {

namespace {

static_assert(kMaxLights <= shader::kMaxLightsInTraversal);

const gl::ProgramSource& CompositeProgram() {
  static const gl::ProgramSource source{
      "composite",
      {{GL_VERTEX_SHADER, spirv_composite_vert}, {GL_FRAGMENT_SHADER, spirv_composite_frag}}};
  return source;
}

// The lights of a traversal, as the shader wants them: what is the same everywhere summed up.
struct TraversalLights {
  glm::vec3 constant{0.0F};
  glm::vec3 constant_shadowed{0.0F};
  std::vector<const Light*> varying;  // the one that casts shadows first
  bool shadow_light_varies = false;
};

TraversalLights SortLights(const Scene& scene, const Traversal& traversal) {
  TraversalLights lights;
  if (traversal.ambient_and_emission) lights.constant = scene.material.ambient;
  if (traversal.shadow_light) {
    const Light& light = scene.lights[static_cast<size_t>(*traversal.shadow_light)];
    lights.shadow_light_varies = RadianceVaries(light, scene.material);
    if (lights.shadow_light_varies) {
      lights.varying.push_back(&light);
    } else {
      lights.constant_shadowed = light.color;
    }
  }
  for (const int index : traversal.unshadowed_lights) {
    const Light& light = scene.lights[static_cast<size_t>(index)];
    if (RadianceVaries(light, scene.material)) {
      lights.varying.push_back(&light);
    } else {
      lights.constant += light.color;
    }
  }
  return lights;
}

shader::CompositeBlock DescribeComposite(const Scene& scene, const Traversal& traversal,
                                         const TraversalLights& lights, const Projection& eye,
                                         const Projection* light) {
  const Material& material = scene.material;
  shader::CompositeBlock block{};
  block.albedo = glm::vec4(material.albedo, material.phase_g);
  if (traversal.ambient_and_emission) block.emission = glm::vec4(material.emission, 0.0F);
  block.constant_light = glm::vec4(lights.constant, 0.0F);
  block.constant_shadowed = glm::vec4(lights.constant_shadowed, 0.0F);
  if (light != nullptr) {
    const Light& source = scene.lights[static_cast<size_t>(*traversal.shadow_light)];
    block.density = glm::vec4(source.shadow_density, 0.0F);
    const glm::dmat3 rotation =
        glm::dmat3(light->view_from_world) * glm::transpose(glm::dmat3(eye.view_from_world));
    block.light_view_from_view = glm::mat4(glm::mat3(rotation));
    const glm::dvec2 size(light->size);
    block.light_texture_from_plane =
        glm::vec4(light->pixel_from_plane / size, light->pixel_offset / size);
  }
  for (size_t i = 0; i < lights.varying.size(); ++i) {
    block.lights[i] = DescribeLight(*lights.varying[i], eye.view_from_world);
  }
  return block;
}

}  // namespace

CompositeTarget MakeCompositeTarget(const Projection& eye, const ParticleView& particles,
                                    const PixelRect& samples, bool depth, bool transmittance) {
  CompositeTarget target;
  shader::ProjectionBlock block = eye.block(particles);
  block.band = glm::vec4(samples.x, samples.y, samples.width, samples.height);
  target.projection = gl::MakeBlock("projection of a band", block);
  const gl::TextureInfo info{
      .label = "image", .format = GL_RGBA32F, .width = samples.width, .height = samples.height};
  target.image = gl::Texture(info);
  if (depth) target.depth = gl::Texture(info);
  if (transmittance) target.transmittance = gl::Texture(info);
  target.framebuffer =
      gl::MakeFramebuffer("composite", {&target.image, &target.depth, &target.transmittance});
  constexpr std::array<float, 4> kZero = {};
  for (GLint i = 0; i < 3; ++i) {
    glClearNamedFramebufferfv(target.framebuffer.name(), GL_COLOR, i, kZero.data());
  }
  return target;
}

CompositePass PrepareComposite(const Scene& scene, const Traversal& traversal,
                               const DeviceOrder& order, const ParticleBuffers& particles,
                               const Projection& eye, const gl::Buffer& eye_splats,
                               const TargetProjection* light, const gl::Buffer* light_splats,
                               const CompositeTarget& target) {
  const bool point_light = light != nullptr && !light->projection.orthographic;
  const bool colored_density =
      light != nullptr &&
      scene.lights[static_cast<size_t>(*traversal.shadow_light)].colored_density();
  const TraversalLights lights = SortLights(scene, traversal);
  return {
      .order = order,
      .particles = particles,
      .eye_splats = eye_splats,
      .light_splats = light_splats,
      .uniforms = gl::MakeBlock("composite",
                                DescribeComposite(scene, traversal, lights, eye,
                                                  light != nullptr ? &light->projection : nullptr)),
      .constants =
          {
              {shader::kOrthographicConstant, eye.orthographic},
              {shader::kBallProfileConstant, scene.material.profile == Profile::kBall},
              {shader::kHasColorsConstant, particles.has_colors},
              // Emission belongs to one traversal only.
              {shader::kHasEmissionsConstant,
               particles.has_emissions && traversal.ambient_and_emission},
              {shader::kShadowedConstant, light != nullptr},
              {shader::kPointShadowLightConstant, point_light},
              {shader::kInterpolateConstant, traversal.interpolate},
              {shader::kColoredLightBufferConstant, traversal.colored_light_buffer},
              {shader::kColoredDensityConstant, colored_density},
              {shader::kVaryingLightsConstant, static_cast<uint32_t>(lights.varying.size())},
              {shader::kShadowLightVariesConstant, lights.shadow_light_varies},
              {shader::kNearEyeConstant, eye.near_eye},
              {shader::kPhaseConstant, scene.material.phase_g != 0.0F},
              {shader::kDepthOutputConstant, static_cast<bool>(target.depth)},
              {shader::kTransmittanceOutputConstant, static_cast<bool>(target.transmittance)},
          },
      .back_to_front = traversal.back_to_front,
  };
}

absl::Status CompositeSlice(Gpu& gpu, const CompositePass& pass, uint32_t begin, uint32_t end,
                            const SliceLight* light, std::span<const CompositeTarget> targets) {
  const gl::DebugScope scope("composite slice");
  const absl::StatusOr<GLuint> program = gpu.programs.Get(CompositeProgram(), pass.constants);
  if (!program.ok()) return program.status();
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  if (pass.back_to_front) {
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  } else {
    glBlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
  }
  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kCompositeBinding, pass.uniforms.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kOrderBinding, pass.order.places.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kColorsBinding, pass.particles.colors.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kEmissionsBinding,
                   pass.particles.emissions.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kSplatsBinding, pass.eye_splats.name());
  if (light != nullptr) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, shader::kLightSplatsBinding,
                     pass.light_splats->name());
    glBindTextureUnit(shader::kLightBeforeBinding, light->before.texture.name());
    glBindTextureUnit(shader::kLightAfterBinding, light->after.texture.name());
  }
  for (const CompositeTarget& target : targets) {
    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer.name());
    glViewport(0, 0, target.image.width(), target.image.height());
    glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, target.projection.name());
    DrawQuads(gpu, begin, end);
  }
  return absl::OkStatus();
}

}  // namespace halflight
