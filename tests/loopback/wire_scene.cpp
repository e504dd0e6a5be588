#include "tests/loopback/wire_scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <variant>

namespace halflight::loopback {
namespace {

std::vector<float> Flat(const std::vector<glm::vec3>& vectors) {
  std::vector<float> floats;
  for (const glm::vec3& vector : vectors) {
    floats.insert(floats.end(), {vector.x, vector.y, vector.z});
  }
  return floats;
}

v1::ShadowTechnique TechniqueOf(ShadowTechniqueKind kind) {
  switch (kind) {
    case ShadowTechniqueKind::kReference:
      return v1::SHADOW_TECHNIQUE_REFERENCE;
    case ShadowTechniqueKind::kLightSweep:
      return v1::SHADOW_TECHNIQUE_LIGHT_SWEEP;
    case ShadowTechniqueKind::kParticleShadowMap:
      return v1::SHADOW_TECHNIQUE_PARTICLE_SHADOW_MAP;
    case ShadowTechniqueKind::kHalfAngle:
      break;
  }
  return v1::SHADOW_TECHNIQUE_HALF_ANGLE;
}

void Set(const glm::dvec3& from, v1::Vector3& to) {
  to.set_x(from.x);
  to.set_y(from.y);
  to.set_z(from.z);
}

void Set(const glm::vec3& from, v1::Color& to) {
  to.set_r(from.x);
  to.set_g(from.y);
  to.set_b(from.z);
}

void Set(const Camera& from, v1::Camera& to) {
  for (int i = 0; i < 16; ++i) {
    to.mutable_world_to_camera()->add_elements(from.view_from_world[i % 4][i / 4]);
  }
  if (const auto* perspective = std::get_if<Perspective>(&from.projection)) {
    to.mutable_perspective()->set_vertical_fov_deg(perspective->vertical_fov * 180.0 /
                                                   std::numbers::pi);
  } else {
    to.mutable_orthographic()->set_height(std::get<Orthographic>(from.projection).height);
  }
  to.set_width(from.width);
  to.set_height(from.height);
  if (from.window.width != from.width || from.window.height != from.height) {
    to.mutable_crop()->set_x(from.window.x);
    to.mutable_crop()->set_y(from.window.y);
    to.mutable_crop()->set_width(from.window.width);
    to.mutable_crop()->set_height(from.window.height);
  }
}

void Set(const Light& from, v1::Light& to) {
  if (const auto* directional = std::get_if<DirectionalLight>(&from.kind)) {
    Set(directional->direction, *to.mutable_directional()->mutable_direction());
  } else {
    const auto& point = std::get<PointLight>(from.kind);
    Set(point.position, *to.mutable_point()->mutable_position());
    to.mutable_point()->set_inverse_square_falloff(point.inverse_square_falloff);
  }
  Set(from.color, *to.mutable_color());
  if (from.colored_density()) {
    Set(from.shadow_density, *to.mutable_density_rgb());
  } else {
    to.set_density(from.shadow_density.x);
  }
}

void Set(const Material& from, v1::Material& to) {
  to.set_profile(from.profile == Profile::kSoft ? v1::PROFILE_SOFT : v1::PROFILE_BALL);
  if (from.radius > 0.0F) {
    to.set_radius(from.radius);
  }
  to.set_opacity(from.opacity);
  Set(from.albedo, *to.mutable_albedo());
  Set(from.emission, *to.mutable_emission());
  Set(from.ambient, *to.mutable_ambient());
  to.set_phase_g(from.phase_g);
  to.set_scattering_spread(from.scattering_spread);
  if (from.physical_scattering) {
    to.mutable_physical_scattering()->set_mean_cosine(from.physical_scattering->mean_cosine);
    to.mutable_physical_scattering()->set_albedo(from.physical_scattering->albedo);
  }
}

}  // namespace

client::EncodedParticles Encoded(const ParticleSet& set) {
  return client::EncodeParticles({.origin = {set.origin.x, set.origin.y, set.origin.z},
                                  .positions = Flat(set.positions),
                                  .radii = set.radii,
                                  .opacities = set.opacities,
                                  .colors = Flat(set.colors),
                                  .velocities = Flat(set.velocities),
                                  .emissions = Flat(set.emissions)});
}

v1::InlineParticles Inline(const ParticleSet& set) {
  const client::EncodedParticles encoded = Encoded(set);
  v1::InlineParticles particles;
  *particles.mutable_layout() = encoded.layout;
  particles.set_payload(encoded.payload);
  return particles;
}

v1::RenderFrameRequest RequestWithoutParticles(const Scene& scene) {
  v1::RenderFrameRequest request;
  v1::Scene& message = *request.mutable_scene();
  if (scene.time_offset_s != 0.0) {
    message.set_time_offset_s(scene.time_offset_s);
  }
  Set(scene.camera, *message.mutable_camera());
  for (const Light& light : scene.lights) {
    Set(light, *message.mutable_lighting()->add_lights());
  }
  Set(scene.material, *message.mutable_material());
  v1::Shadow& shadow = *message.mutable_shadow();
  shadow.set_technique(TechniqueOf(scene.shadow.technique));
  if (scene.shadow.technique == ShadowTechniqueKind::kLightSweep ||
      scene.shadow.technique == ShadowTechniqueKind::kParticleShadowMap) {
    shadow.set_fit_degree(scene.shadow.fit_degree);
  }
  shadow.set_slices(scene.shadow.slices);
  shadow.set_interpolate(scene.shadow.interpolate);
  shadow.set_spacing(scene.shadow.spacing == SliceSpacing::kEqualCount
                         ? v1::SLICE_SPACING_EQUAL_COUNT
                         : v1::SLICE_SPACING_EQUAL_OPTICAL_DEPTH);
  if (scene.shadow.compositor != SliceCompositor::kAuto) {
    shadow.set_compositor(scene.shadow.compositor == SliceCompositor::kRaster
                              ? v1::SLICE_COMPOSITOR_RASTER
                              : v1::SLICE_COMPOSITOR_TILES);
  }
  shadow.set_light_buffer_size(scene.shadow.light_buffer_size);
  if (scene.shadow.blur_mode == BlurMode::kTexelsPerSlice) {
    shadow.set_blur_mode(v1::BLUR_MODE_TEXELS_PER_SLICE);
    shadow.set_blur_texels(scene.shadow.blur_texels);
  }
  if (scene.sampling.supersample > 1) {
    message.mutable_sampling()->set_supersample(scene.sampling.supersample);
  } else if (scene.sampling.downsample > 1) {
    message.mutable_sampling()->set_downsample(scene.sampling.downsample);
  }
  return request;
}

v1::RenderFrameRequest RequestOf(const Scene& scene, v1::OutputKind kind) {
  v1::RenderFrameRequest request = RequestWithoutParticles(scene);
  *request.mutable_scene()->mutable_inline_particles() = Inline(*scene.particles);
  *request.add_outputs() = OutputOf(kind);
  return request;
}

v1::Output OutputOf(v1::OutputKind kind, v1::ImageFormat format) {
  v1::Output output;
  output.set_kind(kind);
  output.set_format(format);
  return output;
}

std::vector<float> FloatsOf(const std::string& bytes) {
  std::vector<float> floats(bytes.size() / sizeof(float));
  std::memcpy(floats.data(), bytes.data(), floats.size() * sizeof(float));
  return floats;
}

double MaxDifference(const std::vector<float>& a, const std::vector<float>& b) {
  double largest = a.size() == b.size() ? 0.0 : std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(a[i]) - b[i]));
  }
  return largest;
}

}  // namespace halflight::loopback
