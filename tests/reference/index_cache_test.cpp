// What is kept between evaluators: the same pixels, nothing made twice, bounds, and nothing of sets
// that are gone.
#include "renderer/reference/index_cache.h"

#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "renderer/reference/evaluator.h"
#include "tests/reference/test_scenes.h"

namespace halflight::reference {
namespace {

constexpr size_t kPlenty = size_t{1} << 30U;

Scene LitScene(unsigned seed = 7) {
  Scene scene = RandomScene(300, 9, seed);
  Light sun;
  sun.kind = DirectionalLight{{0.0, -1.0, 0.0}};
  Light lamp;
  lamp.kind = PointLight{{4.0, 3.0, 2.0}, false};
  scene.lights = {sun, lamp};
  return scene;
}

std::vector<glm::dvec4> PixelsOf(const Scene& scene, IndexCache* kept) {
  const auto evaluator = Evaluator::Create(scene, {}, kept);
  EXPECT_TRUE(evaluator.ok());
  return (*evaluator)->EvaluateWindow()->rgba;
}

struct Change {
  const char* name;
  std::function<void(Scene&)> make;
};

// One of everything that a pixel depends on.
const std::vector<Change>& Changes() {
  static const std::vector<Change> changes{
      {"set", [](Scene& scene) { scene.particles = LitScene(8).particles; }},
      {"time", [](Scene& scene) { scene.time_offset_s = 0.3; }},
      {"profile", [](Scene& scene) { scene.material.profile = Profile::kBall; }},
      {"albedo",
       [](Scene& scene) {
         scene.material.albedo = {0.5F, 1.0F, 1.0F};
       }},
      {"ambient", [](Scene& scene) { scene.material.ambient = glm::vec3(0.7F); }},
      {"phase", [](Scene& scene) { scene.material.phase_g = 0.6F; }},
      {"direction",
       [](Scene& scene) {
         scene.lights[0].kind = DirectionalLight{{1.0, 0.0, 0.0}};
       }},
      {"place",
       [](Scene& scene) {
         scene.lights[1].kind = PointLight{{4.0, 3.0, 2.5}, false};
       }},
      {"density", [](Scene& scene) { scene.lights[0].shadow_density = glm::vec3(2.0F); }},
      {"no shadow", [](Scene& scene) { scene.lights[1].shadow_density = glm::vec3(0.0F); }},
      {"eye",
       [](Scene& scene) {
         scene.camera.view_from_world = glm::translate(glm::dmat4(1.0), glm::dvec3(0.2, 0.0, -8.0));
       }},
      {"projection", [](Scene& scene) { scene.camera.projection = Orthographic{3.0}; }},
      {"window",
       [](Scene& scene) {
         scene.camera.window = {2, 3, 4, 5};
       }},
      {"samples", [](Scene& scene) { scene.sampling.supersample = 2; }},
      // Those that a set with radii, opacities and emissions of its own does not show.
      {"uniform attributes",
       [](Scene& scene) {
         auto set = std::make_shared<ParticleSet>(*scene.particles);
         set->radii.clear();
         set->opacities.clear();
         set->emissions.clear();
         scene.particles = set;
       }},
  };
  return changes;
}

TEST(IndexCache, PixelsAreThoseOfAnEvaluatorWithoutWhateverChanged) {
  IndexCache kept(kPlenty);
  const Scene first = LitScene();
  EXPECT_EQ(PixelsOf(first, &kept), PixelsOf(first, nullptr));
  for (const Change& change : Changes()) {
    Scene scene = first;
    change.make(scene);
    const auto expected = PixelsOf(scene, nullptr);
    EXPECT_EQ(PixelsOf(scene, &kept), expected) << change.name;
    EXPECT_EQ(PixelsOf(scene, &kept), expected) << change.name << ", found";
    EXPECT_EQ(PixelsOf(first, &kept), PixelsOf(first, nullptr)) << "back from " << change.name;
  }
}

TEST(IndexCache, UniformRadiusOpacityAndEmissionArePartOfWhatIsAskedFor) {
  IndexCache kept(kPlenty);
  Scene scene = SceneOf({{0.0F, 0.0F, 1.0F}, {0.1F, 0.0F, -1.0F}}, 9);
  for (const auto& change : std::vector<Change>{
           {"radius", [](Scene& changed) { changed.material.radius = 0.7F; }},
           {"opacity", [](Scene& changed) { changed.material.opacity = 0.9F; }},
           {"emission", [](Scene& changed) { changed.material.emission = glm::vec3(0.4F); }}}) {
    const auto before = PixelsOf(scene, &kept);
    change.make(scene);
    const auto after = PixelsOf(scene, &kept);
    EXPECT_NE(after, before) << change.name;
    EXPECT_EQ(after, PixelsOf(scene, nullptr)) << change.name;
  }
}

TEST(IndexCache, LightsAreFoundAgainWhereOnlyTheCameraMoved) {
  IndexCache kept(kPlenty);
  Scene scene = LitScene();
  const auto cloud = kept.ParticlesOf(scene);
  const Rays light = RaysOf(scene.lights[0], scene);
  const auto depth = kept.DepthOf(scene, *cloud, light, {});
  const auto eye = kept.EyeIndexOf(scene, *cloud, Eye(scene).rays(), {});
  EXPECT_EQ(kept.EyeIndexOf(scene, *cloud, Eye(scene).rays(), {}), eye);

  scene.camera.view_from_world = glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 0.0, -9.0));
  EXPECT_EQ(kept.ParticlesOf(scene), cloud);
  EXPECT_EQ(kept.DepthOf(scene, *cloud, light, {}), depth);
  EXPECT_NE(kept.EyeIndexOf(scene, *cloud, Eye(scene).rays(), {}), eye);
}

TEST(IndexCache, HoldsNoMoreThanItMayAndDropsWhatWasUsedLeastRecently) {
  Scene scene = LitScene();
  size_t bytes_of_one = 0;
  {
    IndexCache one(kPlenty);
    PixelsOf(scene, &one);
    bytes_of_one = one.bytes();
    EXPECT_GT(bytes_of_one, 300U * sizeof(Particle));
  }
  const size_t most = 2 * bytes_of_one;
  IndexCache kept(most);
  const auto cloud = kept.ParticlesOf(scene);
  for (int turn = 0; turn < 20; ++turn) {
    scene.lights[0].kind = DirectionalLight{glm::normalize(glm::dvec3(0.1 * turn, -1.0, 0.2))};
    PixelsOf(scene, &kept);
    EXPECT_LE(kept.bytes(), most);
    EXPECT_GE(kept.bytes(), bytes_of_one / 2);
    EXPECT_EQ(kept.ParticlesOf(scene), cloud) << "used every time";
  }
  IndexCache small(bytes_of_one / 100);
  PixelsOf(scene, &small);
  EXPECT_EQ(small.bytes(), 0U);
}

TEST(IndexCache, ForgetsSetsThatAreGone) {
  IndexCache kept(kPlenty);
  Scene scene = LitScene();
  const Scene other = LitScene(8);
  PixelsOf(other, &kept);
  const size_t bytes_of_other = kept.bytes();
  PixelsOf(scene, &kept);
  EXPECT_GT(kept.bytes(), bytes_of_other);
  scene.particles.reset();
  EXPECT_EQ(kept.bytes(), bytes_of_other);
}

TEST(IndexCache, KeepsNothingThatWasStoppedHalfway) {
  IndexCache kept(kPlenty);
  const Scene scene = LitScene();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(Evaluator::Create(scene, stop.get_token(), &kept).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(PixelsOf(scene, &kept), PixelsOf(scene, nullptr));
}

}  // namespace
}  // namespace halflight::reference
