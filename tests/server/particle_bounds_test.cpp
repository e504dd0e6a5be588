// What conversion knows of whole sets: that it is right, and that no set is walked over twice.

#include "server/convert/particle_bounds.h"

#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/convert/convert_scene.h"
#include "server/convert/scene_checks.h"

namespace halflight {
namespace {

std::shared_ptr<ParticleSet> TwoParticles() {
  auto set = std::make_shared<ParticleSet>();
  set->positions = {{-1, 0, 0}, {1, 2, 0}};
  set->velocities = {{1, 0, 0}, {-3, 0, 4}};
  set->radii = {0.25F, 0.5F};
  return set;
}

TEST(ParticleBounds, HoldEveryParticleWhereverItHasMovedTo) {
  const ParticleBounds bounds = FindBounds(*TwoParticles());
  EXPECT_EQ(bounds.at_rest->center, Bounds(*TwoParticles(), 0.0F, 0.0)->center);
  EXPECT_EQ(bounds.at_rest->radius, Bounds(*TwoParticles(), 0.0F, 0.0)->radius);
  EXPECT_EQ(bounds.largest_radius, 0.5F);
  EXPECT_EQ(PositionsAfter(bounds, 0.0).low, glm::dvec3(-1, 0, 0));
  EXPECT_EQ(PositionsAfter(bounds, 2.0).low, glm::dvec3(-7, 0, 0));
  EXPECT_EQ(PositionsAfter(bounds, 2.0).high, glm::dvec3(3, 2, 8));
  EXPECT_EQ(PositionsAfter(bounds, -2.0).low, glm::dvec3(-3, 0, -8));
  EXPECT_FALSE(FindBounds({}).at_rest.has_value());
}

TEST(BoundsCache, KnowsASetByItsObject) {
  BoundsCache cache;
  const std::shared_ptr<const ParticleSet> set = TwoParticles();
  const std::shared_ptr<const ParticleSet> same_values = TwoParticles();
  const auto first = cache.Of(set);
  EXPECT_EQ(cache.Of(set), first);
  EXPECT_NE(cache.Of(same_values), first);
  EXPECT_EQ(cache.size(), 2U);
}

TEST(BoundsCache, ForgetsSetsThatAreGone) {
  BoundsCache cache;
  const std::shared_ptr<const ParticleSet> kept = TwoParticles();
  const auto bounds = cache.Of(kept);
  for (int i = 0; i < 1000; ++i) {
    cache.Of(TwoParticles());
  }
  EXPECT_LT(cache.size(), 50U);
  EXPECT_EQ(cache.Of(kept), bounds);
}

TEST(BoundsCache, ThreadsThatAskAtOnceGetTheSame) {
  BoundsCache cache;
  auto set = std::make_shared<ParticleSet>();
  set->positions.resize(100000, {1, 2, 3});
  std::vector<std::shared_ptr<const ParticleBounds>> found(4);
  {
    std::vector<std::jthread> threads;
    for (auto& bounds : found) {
      threads.emplace_back([&] { bounds = cache.Of(set); });
    }
  }
  for (const auto& bounds : found) {
    EXPECT_EQ(bounds, found[0]);
    EXPECT_EQ(bounds->positions.high, glm::dvec3(1, 2, 3));
  }
}

// Of a point light at (x, 0, 0), with shadows.
absl::Status CheckLight(const std::shared_ptr<const ParticleSet>& set, double x, double seconds) {
  v1::Scene scene;
  scene.set_time_offset_s(seconds);
  scene.mutable_camera()->mutable_look_at()->mutable_eye()->set_z(100.0);
  scene.mutable_camera()->mutable_look_at()->mutable_target();
  scene.mutable_camera()->set_width(8);
  scene.mutable_camera()->set_height(8);
  scene.mutable_lighting()->add_lights()->mutable_point()->mutable_position()->set_x(x);
  FieldChecks checks;
  const Scene converted = ConvertScene(scene, set, {}, checks);
  if (checks.ok()) {
    CheckTechnique(converted, {}, checks);
  }
  return checks.status();
}

// Sets do not change; this one does, to see who looks at it again.
TEST(ConvertScene, WalksOverASetOnce) {
  const std::shared_ptr<ParticleSet> set = TwoParticles();
  EXPECT_TRUE(CheckLight(set, 10.0, 0.0).ok());
  EXPECT_TRUE(CheckLight(set, 100.0, 1.0).ok());
  EXPECT_TRUE(CheckLight(set, 5.0, 2.0).ok()) << "near enough to be looked at closely";
  set->positions[1].x = 1000.0F;
  EXPECT_TRUE(CheckLight(set, 10.0, 0.0).ok());
  EXPECT_TRUE(CheckLight(set, 100.0, 1.0).ok());
  EXPECT_TRUE(CheckLight(set, 5.0, 2.0).ok());
  const std::shared_ptr<ParticleSet> other = std::make_shared<ParticleSet>(*set);
  EXPECT_FALSE(CheckLight(other, 10.0, 0.0).ok()) << "what is known of another set";
  EXPECT_FALSE(CheckLight(other, 100.0, 1.0).ok());
  EXPECT_FALSE(CheckLight(other, 5.0, 2.0).ok());
}

// Whatever is known before a walk, a light is refused exactly where it is not outside the sphere.
TEST(ConvertScene, RefusesLightsAmongMovingParticlesAsTheirSphereSays) {
  const std::shared_ptr<const ParticleSet> set = TwoParticles();
  for (const double seconds : {-1.5, 0.0, 0.5, 2.0}) {
    const BoundingSphere sphere = *Bounds(*set, 0.0F, seconds);
    for (double x = -30.0; x <= 30.0; x += 0.125) {
      const bool outside = glm::length(glm::dvec3(x, 0, 0) - sphere.center) > sphere.radius;
      EXPECT_EQ(CheckLight(set, x, seconds).ok(), outside) << x << " after " << seconds;
    }
  }
}

}  // namespace
}  // namespace halflight
