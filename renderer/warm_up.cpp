// A table of scenes that differ in what the passes are specialised for; see warm_up.h.
#include "renderer/warm_up.h"

#include <memory>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

namespace halflight {

namespace {

// Two particles, one in the other's shadow under either light, before a camera on the z axis.
Scene SmallScene() {
  constexpr int kSize = 16;
  Scene scene;
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{0.0F, 0.0F, 0.5F}, {0.0F, 0.0F, -0.5F}};
  scene.particles = set;
  scene.material.radius = 1.0F;
  scene.camera.view_from_world = glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 0.0, -5.0));
  scene.camera.width = scene.camera.height = kSize;
  scene.camera.window = {0, 0, kSize, kSize};
  scene.shadow.slices = 2;
  scene.shadow.light_buffer_size = kSize;
  return scene;
}

Light Sun(const glm::dvec3& direction) {
  Light light;
  light.kind = DirectionalLight{glm::normalize(direction)};
  return light;
}

// The particle attributes that programs care for, listed instead of uniform.
void ListAttributes(Scene& scene) {
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->radii.assign(set->size(), 1.0F);
  set->opacities.assign(set->size(), 0.2F);
  set->colors.assign(set->size(), glm::vec3(1.0F));
  scene.particles = set;
}

}  // namespace

std::vector<FrameRequest> WarmUpFrames() {
  // Light along with the view is composited front to back, against it back to front.
  const Light front = Sun({0.3, -0.5, -1.0});
  const Light back = Sun({0.3, -0.5, 1.0});
  std::vector<FrameRequest> frames;
  const auto add = [&frames](const Scene& scene) {
    frames.push_back({scene, {{ImageKind::kBeauty}}});
  };

  Scene scene = SmallScene();
  scene.lights = {front};
  add(scene);
  scene.lights = {back};
  add(scene);
  scene.shadow.technique = ShadowTechniqueKind::kLightSweep;
  add(scene);

  Scene listed = SmallScene();
  ListAttributes(listed);
  for (const Light& light : {front, back}) {
    listed.lights = {light};
    add(listed);
  }

  Scene coloured = SmallScene();
  for (Light light : {front, back}) {
    light.shadow_density = {0.3F, 0.6F, 1.2F};
    coloured.lights = {light};
    add(coloured);
  }

  // Two lights: the second one's image is added to the first one's.
  Scene with_depth = SmallScene();
  with_depth.lights = {front, back};
  frames.push_back({with_depth, {{ImageKind::kBeauty}, {ImageKind::kDepth}}});

  Scene supersampled = SmallScene();
  supersampled.lights = {front};
  supersampled.sampling.supersample = 2;
  add(supersampled);

  Scene scattering = SmallScene();
  scattering.lights = {front};
  scattering.material.scattering_spread = 0.1F;
  add(scattering);

  Scene unlit = SmallScene();
  add(unlit);
  return frames;
}

}  // namespace halflight
