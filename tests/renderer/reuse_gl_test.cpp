// What is reused between frames: the same bytes as without, no work twice, no memory beyond its
// bound, nothing of sets that are gone.
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <string>
#include <vector>

#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

struct Variation {
  const char* name;
  void (*change)(Scene&);
};

void Move(Scene& scene) {
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->velocities.assign(set->size(), glm::vec3(0.1F, -0.2F, 0.05F));
  scene.particles = set;
  scene.time_offset_s = 1.0;
}

// Each differs from the first in one thing that some kept work depends on, or none does.
const std::vector<Variation>& Variations() {
  static const std::vector<Variation> variations = {
      {"as it is", [](Scene&) {}},
      {"camera",
       [](Scene& s) {
         s.camera = test::LookAt({1, 0.5, 3.8}, {0, 0, 0}, 96, 96);
       }},
      {"window",
       [](Scene& s) {
         s.camera.window = {10, 20, 50, 41};
       }},
      {"parallel rays", [](Scene& s) { s.camera.projection = Orthographic{2.5}; }},
      {"supersample", [](Scene& s) { s.sampling.supersample = 2; }},
      {"downsample", [](Scene& s) { s.sampling.downsample = 2; }},
      {"light's direction",
       [](Scene& s) {
         s.lights = {test::Sun({-1, -1, -0.5})};
       }},
      {"light's color",
       [](Scene& s) {
         s.lights[0].color = {1, 0.5, 0.2};
       }},
      {"light's density",
       [](Scene& s) {
         s.lights[0].shadow_density = {0.5, 1, 2};
       }},
      {"point light",
       [](Scene& s) {
         s.lights[0].kind = PointLight{{3, 3, 2}, false};
       }},
      {"falling off",
       [](Scene& s) {
         s.lights[0].kind = PointLight{{3, 3, 2}, true};
       }},
      {"second light",
       [](Scene& s) {
         s.lights.push_back(test::Sun({0, -1, 0.2}));
       }},
      {"no shadows", [](Scene& s) { s.lights[0].shadow_density = glm::vec3(0); }},
      {"degree", [](Scene& s) { s.shadow.fit_degree = 2; }},
      {"light buffer", [](Scene& s) { s.shadow.light_buffer_size = 64; }},
      {"slices", [](Scene& s) { s.shadow.slices = 7; }},
      {"spacing", [](Scene& s) { s.shadow.spacing = SliceSpacing::kEqualOpticalDepth; }},
      {"profile", [](Scene& s) { s.material.profile = Profile::kBall; }},
      {"radius", [](Scene& s) { s.material.radius = 0.1F; }},
      {"opacity", [](Scene& s) { s.material.opacity = 0.6F; }},
      {"ambient", [](Scene& s) { s.material.ambient = glm::vec3(0.4F); }},
      {"phase", [](Scene& s) { s.material.phase_g = 0.5F; }},
      {"particles", [](Scene& s) { s.particles = test::Ball(s.particles->size(), 2); }},
      {"varied particles", [](Scene& s) { test::VaryParticles(s, 0.1F, 0.5F); }},
      {"moved particles", Move},
  };
  return variations;
}

// What draws.
struct Drawing {
  const char* name;
  ShadowTechniqueKind technique;
  SweepOn sweep_on = SweepOn::kCpu;
};
constexpr Drawing kSlices = {"HalfAngle", ShadowTechniqueKind::kHalfAngle};
constexpr Drawing kSweep = {"LightSweep", ShadowTechniqueKind::kLightSweep};
constexpr Drawing kSweepOnDevice = {"LightSweepOnDevice", ShadowTechniqueKind::kLightSweep,
                                    SweepOn::kDevice};
void PrintTo(const Drawing& drawing, std::ostream* out) { *out << drawing.name; }
std::string NameOf(const testing::TestParamInfo<Drawing>& instance) { return instance.param.name; }

class Reuse : public test::GlTest, public testing::WithParamInterface<Drawing> {
 protected:
  Reuse() : renderer_(*FrameRenderer::Create("auto")) {}

  static Scene Base() {
    Scene scene = test::BallScene(400);
    scene.shadow.technique = GetParam().technique;
    scene.shadow.slices = 12;
    return scene;
  }

  static FrameRequest AllOutputs(const Scene& scene) {
    FrameRequest request{scene, {{ImageKind::kBeauty}, {ImageKind::kDepth}}};
    request.sweep_on = GetParam().sweep_on;
    if (scene.lights[0].casts_shadows()) {
      request.images.push_back({ImageKind::kLightTransmittance, 0});
      request.images.push_back({ImageKind::kLightBuffer, 0});
    }
    return request;
  }

  static FrameRequest Beauty(const Scene& scene) {
    FrameRequest request = test::Beauty(scene);
    request.sweep_on = GetParam().sweep_on;
    return request;
  }

  FrameResult Draw(const FrameRequest& request) {
    absl::StatusOr<FrameResult> frame = renderer_->Render(request, {});
    EXPECT_TRUE(frame.ok()) << frame.status();
    return frame.ok() ? *std::move(frame) : FrameResult{};
  }

  // Passes of the frame that were not run.
  std::vector<std::string> Kept(const Scene& scene) {
    std::vector<std::string> names;
    for (const PlannedPass& pass : Draw(Beauty(scene)).plan.passes) {
      if (pass.count == 0) names.push_back(pass.name);
    }
    return names;
  }

  std::unique_ptr<FrameRenderer> renderer_;
};

INSTANTIATE_TEST_SUITE_P(Techniques, Reuse, testing::Values(kSlices, kSweep, kSweepOnDevice),
                         NameOf);

void ExpectSameBytes(const FrameResult& a, const FrameResult& b, const std::string& what) {
  ASSERT_EQ(a.images.size(), b.images.size()) << what;
  for (size_t i = 0; i < a.images.size(); ++i) {
    EXPECT_TRUE(a.images[i].pixels == b.images[i].pixels) << what << ", output " << i;
  }
}

// In three orders, so that every variation comes after others.
TEST_P(Reuse, GivesTheSameBytesWhateverWasDrawnBefore) {
  const Scene base = Base();
  std::vector<FrameRequest> requests;
  std::vector<FrameResult> alone;
  for (const Variation& variation : Variations()) {
    Scene scene = base;
    variation.change(scene);
    requests.push_back(AllOutputs(scene));
    FrameRequest fresh = requests.back();
    fresh.reuse = false;
    alone.push_back(Draw(fresh));
  }
  EXPECT_TRUE(renderer_->cache().empty());
  for (const size_t stride : {size_t{1}, size_t{7}, requests.size() - 1}) {
    for (size_t k = 0; k < requests.size(); ++k) {
      const size_t i = k * stride % requests.size();
      ExpectSameBytes(Draw(requests[i]), alone[i], Variations()[i].name);
    }
  }
  EXPECT_GT(renderer_->cache().found(), requests.size());
}

TEST_P(Reuse, KeepsNothingOfSetsThatAreGone) {
  const Scene base = Base();
  Draw(Beauty(base));
  const size_t of_base = renderer_->cache().bytes();
  EXPECT_GT(of_base, 0U);
  Scene scene = base;
  // New sets, wherever they come to lie.
  for (uint32_t seed = 2; seed < 8; ++seed) {
    scene.particles.reset();
    scene.particles = test::Ball(400, seed);
    FrameRequest fresh = Beauty(scene);
    fresh.reuse = false;
    ExpectSameBytes(Draw(Beauty(scene)), Draw(fresh), "seed " + std::to_string(seed));
  }
  const std::weak_ptr<const ParticleSet> watch = scene.particles;
  scene.particles.reset();
  EXPECT_TRUE(watch.expired());
  Draw(Beauty(base));
  EXPECT_EQ(renderer_->cache().bytes(), of_base);
}

TEST_P(Reuse, StaysWithinItsBound) {
  const Scene base = Base();
  Draw(Beauty(base));
  const size_t bound = renderer_->cache().bytes() * 3 / 2;
  const auto bounded = *FrameRenderer::Create("auto", {.max_reuse_bytes = bound});
  const auto without = *FrameRenderer::Create("auto", {.max_reuse_bytes = 0});
  for (const Variation& variation : Variations()) {
    Scene scene = base;
    variation.change(scene);
    const auto frame = bounded->Render(Beauty(scene), {});
    const auto other = without->Render(Beauty(scene), {});
    ASSERT_TRUE(frame.ok() && other.ok());
    ExpectSameBytes(*frame, *other, variation.name);
    EXPECT_LE(bounded->cache().bytes(), bound);
  }
  EXPECT_FALSE(bounded->cache().empty());
  EXPECT_TRUE(without->cache().empty());
}

TEST_P(Reuse, IsOffWhereTheRequestSaysSo) {
  FrameRequest request = Beauty(Base());
  Draw(request);
  request.reuse = false;
  for (const PlannedPass& pass : Draw(request).plan.passes) EXPECT_GT(pass.count, 0) << pass.name;
  request.reuse = true;
  const FrameResult again = Draw(request);
  EXPECT_TRUE(std::any_of(again.plan.passes.begin(), again.plan.passes.end(),
                          [](const PlannedPass& pass) { return pass.count == 0; }));
}

using ReuseOfSweep = Reuse;
INSTANTIATE_TEST_SUITE_P(Techniques, ReuseOfSweep, testing::Values(kSweep, kSweepOnDevice), NameOf);

const std::vector<std::string> kLight = {"sort along the light",
                                         "sweep the light buffer through the particles",
                                         "fit the light over every footprint"};
const std::string kEye = "sort by distance from the eye";

TEST_P(ReuseOfSweep, TurningTheCameraKeepsTheLight) {
  Scene scene = Base();
  EXPECT_TRUE(Kept(scene).empty());
  scene.camera = test::LookAt({1, 0.5, 3.8}, {0, 0, 0}, 96, 96);
  EXPECT_EQ(Kept(scene), kLight);
}

TEST_P(ReuseOfSweep, ChangingHowTheLightShinesKeepsAllButShading) {
  Scene scene = Base();
  Kept(scene);
  std::vector<std::string> all = kLight;
  all.push_back(kEye);
  scene.lights[0].color = {1, 0.5, 0.2};
  scene.lights[0].shadow_density = {0.5, 1, 2};
  scene.material.ambient = glm::vec3(0.3F);
  EXPECT_EQ(Kept(scene), all);
}

TEST_P(ReuseOfSweep, TurningTheLightKeepsWhatTheEyeSees) {
  Scene scene = Base();
  Kept(scene);
  scene.lights[0] = test::Sun({-1, -1, 0.2});
  EXPECT_EQ(Kept(scene), std::vector<std::string>{kEye});
}

using ReuseOfSlices = Reuse;
INSTANTIATE_TEST_SUITE_P(Techniques, ReuseOfSlices, testing::Values(kSlices), NameOf);

// The half vector turns with the camera: only what leaves it where it is keeps the order.
TEST_P(ReuseOfSlices, KeepTheOrderWhileTheHalfVectorStays) {
  Scene scene = Base();
  EXPECT_TRUE(Kept(scene).empty());
  const std::vector<std::string> sort = {"sort along the half vector, front to back"};
  scene.lights[0].color = {1, 0.5, 0.2};
  EXPECT_EQ(Kept(scene), sort);
  scene.camera.window = {10, 20, 50, 41};
  EXPECT_EQ(Kept(scene), sort);
  scene.camera = test::LookAt({1, 0.5, 3.8}, {0, 0, 0}, 96, 96);
  EXPECT_TRUE(Kept(scene).empty());
}

}  // namespace
}  // namespace halflight
