// How the sorted particles are cut into slices.
#include "renderer/particle_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include <glm/geometric.hpp>

#include "tests/renderer/test_scene.h"

namespace halflight {
namespace {

struct Cut {
  const char* name;
  size_t particles;
  int slices;
  SliceSpacing spacing;
};

class Slices : public testing::TestWithParam<Cut> {
 protected:
  Slices() {
    scene_ = test::BallScene(GetParam().particles);
    auto varied = std::make_shared<ParticleSet>(*scene_.particles);
    for (size_t i = 0; i < varied->size(); ++i) {
      varied->radii.push_back(0.01F + 0.01F * static_cast<float>(i % 13));
    }
    scene_.particles = varied;
    traversal_.axis = glm::normalize(glm::dvec3(1, 2, 3));
    traversal_.slices = GetParam().slices;
    traversal_.spacing = GetParam().spacing;
  }

  Scene scene_;
  Traversal traversal_;
};

TEST_P(Slices, HoldEveryParticleExactlyOnce) {
  const ParticleOrder order = OrderParticles(ParticleView(scene_), traversal_, {});
  std::set<uint32_t> indices;
  for (const shader::OrderedParticle& particle : order.particles) indices.insert(particle.index);
  EXPECT_EQ(indices.size(), GetParam().particles);
  EXPECT_EQ(order.particles.size(), GetParam().particles);
  EXPECT_EQ(order.slice_begin.front(), 0U);
  EXPECT_EQ(order.slice_begin.back(), GetParam().particles);
  EXPECT_TRUE(std::is_sorted(order.slice_begin.begin(), order.slice_begin.end()));
}

TEST_P(Slices, AreOneParticleEachWhereThereAreEnough) {
  const ParticleOrder order = OrderParticles(ParticleView(scene_), traversal_, {});
  if (static_cast<size_t>(GetParam().slices) < GetParam().particles) return;
  ASSERT_EQ(order.slice_begin.size(), std::max<size_t>(GetParam().particles, 1) + 1);
  for (size_t s = 0; s + 1 < order.slice_begin.size(); ++s) {
    EXPECT_EQ(order.slice_begin[s], s);
  }
}

TEST_P(Slices, FollowOneAnotherAlongTheAxis) {
  const ParticleOrder order = OrderParticles(ParticleView(scene_), traversal_, {});
  const auto at = [&](size_t k) {
    return glm::dot(glm::dvec3(scene_.particles->positions[order.particles[k].index]),
                    *traversal_.axis);
  };
  for (size_t k = 1; k < order.particles.size(); ++k) EXPECT_LE(at(k - 1), at(k) + 1e-6);
  EXPECT_TRUE(std::is_sorted(order.slice_position.begin(), order.slice_position.end()));
}

TEST_P(Slices, PlaceTheirFirstParticleAtZeroAndTheirLastAtOne) {
  const ParticleOrder order = OrderParticles(ParticleView(scene_), traversal_, {});
  for (size_t s = 0; s + 1 < order.slice_begin.size(); ++s) {
    const uint32_t begin = order.slice_begin[s];
    const uint32_t end = order.slice_begin[s + 1];
    if (end - begin < 2) continue;
    EXPECT_EQ(order.particles[begin].place, 0.0F);
    EXPECT_EQ(order.particles[end - 1].place, 1.0F);
  }
}

TEST_P(Slices, ShareWhatTheirSpacingSharesEvenly) {
  const ParticleView particles(scene_);
  const ParticleOrder order = OrderParticles(particles, traversal_, {});
  const size_t slices = order.slice_begin.size() - 1;
  std::vector<double> share(slices);
  double total = 0.0;
  double largest = 0.0;
  for (size_t s = 0; s < slices; ++s) {
    for (uint32_t k = order.slice_begin[s]; k < order.slice_begin[s + 1]; ++k) {
      const double radius = particles.radius(order.particles[k].index);
      const double weight = GetParam().spacing == SliceSpacing::kEqualCount ? 1.0 : radius * radius;
      share[s] += weight;
      total += weight;
      largest = std::max(largest, weight);
    }
  }
  for (const double each : share) EXPECT_NEAR(each, total / static_cast<double>(slices), largest);
}

INSTANTIATE_TEST_SUITE_P(
    Cuts, Slices,
    testing::Values(Cut{"Dividing", 1024, 32, SliceSpacing::kEqualCount},
                    Cut{"WithRemainder", 1000, 33, SliceSpacing::kEqualCount},
                    Cut{"OneParticleEach", 100, 100, SliceSpacing::kEqualCount},
                    Cut{"MoreThanParticles", 10, 64, SliceSpacing::kEqualCount},
                    Cut{"OneSlice", 100, 1, SliceSpacing::kEqualCount},
                    Cut{"OneParticle", 1, 16, SliceSpacing::kEqualCount},
                    Cut{"ByDepth", 1000, 32, SliceSpacing::kEqualOpticalDepth},
                    Cut{"ByDepthMoreThanParticles", 10, 64, SliceSpacing::kEqualOpticalDepth}),
    [](const auto& param) { return param.param.name; });

TEST(OrderByDistance, PutsTheNearestToTheEyeFirst) {
  const Scene scene = test::BallScene(500);
  const glm::dvec3 eye(0, 0, 4);
  const ParticleOrder order = OrderParticles(ParticleView(scene), Traversal{}, eye);
  double last = 0.0;
  for (const shader::OrderedParticle& particle : order.particles) {
    const double distance =
        glm::distance(eye, glm::dvec3(scene.particles->positions[particle.index]));
    EXPECT_GE(distance, last - 1e-6);
    last = distance;
  }
}

TEST(OrderOfNothing, IsOneEmptySlice) {
  Scene scene;
  scene.particles = std::make_shared<ParticleSet>();
  const ParticleOrder order = OrderParticles(ParticleView(scene), Traversal{}, {});
  EXPECT_TRUE(order.particles.empty());
  EXPECT_EQ(order.slice_begin, (std::vector<uint32_t>{0, 0}));
}

}  // namespace
}  // namespace halflight
