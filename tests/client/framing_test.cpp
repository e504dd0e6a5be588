#include "client/framing.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "client/readers/reader.h"

namespace halflight::client {
namespace {

double Dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 Minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3 Cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec3 Unit(const Vec3& a) {
  const double length = std::sqrt(Dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

// The part of the image that particles cover, from -1 to 1 along either axis.
struct Extent {
  double left = 9, right = -9, bottom = 9, top = -9;
  [[nodiscard]] double Margin() const {
    return std::min(std::min(left + 1, 1 - right), std::min(bottom + 1, 1 - top));
  }
};

// Projects every particle by the angles that its outline makes with the axis of the view, which
// FrameParticles does not use.
Extent Project(const Particles& particles, double radius, const View& view, const Vec3& up,
               const Projection& projection) {
  const Vec3 forward = Unit(Minus(view.target, view.eye));
  const Vec3 right = Unit(Cross(forward, up));
  const Vec3 above = Cross(right, forward);
  const double tan_y = std::tan(projection.vertical_fov_deg * std::numbers::pi / 360);
  Extent extent;
  for (size_t i = 0; i < particles.size(); ++i) {
    const Vec3 centre = {particles.origin[0] + particles.positions[3 * i],
                         particles.origin[1] + particles.positions[3 * i + 1],
                         particles.origin[2] + particles.positions[3 * i + 2]};
    const double r = particles.radii.empty() ? radius : particles.radii[i];
    const Vec3 offset = Minus(centre, view.eye);
    const double depth = Dot(offset, forward);
    auto span = [&](double across, double half_size, double& low, double& high) {
      if (projection.orthographic) {
        low = std::min(low, (across - r) / half_size);
        high = std::max(high, (across + r) / half_size);
        EXPECT_GT(depth, r);
        return;
      }
      const double angle = std::atan2(across, depth);
      const double half_angle = std::asin(std::min(1.0, r / std::hypot(across, depth)));
      low = std::min(low, std::tan(angle - half_angle) / half_size);
      high = std::max(high, std::tan(angle + half_angle) / half_size);
    };
    const double half_y = projection.orthographic ? view.orthographic_height / 2 : tan_y;
    span(Dot(offset, right), half_y * projection.aspect, extent.left, extent.right);
    span(Dot(offset, above), half_y, extent.bottom, extent.top);
  }
  return extent;
}

Particles RandomCloud(const Vec3& origin, const Vec3& size) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-1, 1);
  Particles particles;
  particles.origin = origin;
  for (int i = 0; i < 500; ++i) {
    for (size_t axis = 0; axis < 3; ++axis) {
      particles.positions.push_back(static_cast<float>(size[axis]) * uniform(random));
    }
    particles.radii.push_back(0.05F * (1.2F + uniform(random)));
  }
  return particles;
}

Particles Plume() { return *ReadParticles(HALFLIGHT_TEST_DATA "/plume/plume.0040.ply"); }

TEST(FrameParticles, ShowsEveryParticleWithASmallMargin) {
  for (const Vec3& size : {Vec3{1, 1, 1}, Vec3{4, 0.1, 0.1}, Vec3{0.1, 5, 0.3}, Vec3{3, 0, 3}}) {
    for (const double aspect : {0.4, 4.0 / 3, 3.0}) {
      for (const double fov : {10.0, 40.0, 100.0}) {
        for (const Vec3& up : {Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{1, 2, 0}}) {
          const Particles cloud = RandomCloud({1e7, -3, 2e6}, size);
          const Projection projection{aspect, fov, false};
          const View view = FrameParticles({&cloud}, 1, projection, {{}, {}, up});
          const Extent extent = Project(cloud, 1, view, up, projection);
          EXPECT_NEAR(extent.Margin(), 0.08, 1e-3) << fov << " " << aspect;  // 4 % of 2
        }
      }
    }
  }
}

TEST(FrameParticles, ShowsEveryParticleInAParallelProjection) {
  const Particles cloud = RandomCloud({0, 0, 0}, {1, 2, 3});
  const Projection projection{1.5, 40, true};
  const View view = FrameParticles({&cloud}, 1, projection, {});
  EXPECT_NEAR(Project(cloud, 1, view, {0, 1, 0}, projection).Margin(), 0.08, 1e-6);
}

TEST(FrameParticles, LooksAtThePlumeFromAboveTheFrontRight) {
  const Particles plume = Plume();
  const View view = FrameParticles({&plume}, 0.045, {}, {});
  const Vec3 from = Unit(Minus(view.eye, view.target));
  EXPECT_NEAR(from[1], std::sin(20 * std::numbers::pi / 180), 1e-9);
  EXPECT_GT(from[0], 0.3);
  EXPECT_GT(from[2], 0.5);
  EXPECT_GT(Project(plume, 0.045, view, {0, 1, 0}, {}).Margin(), 0.079);
}

TEST(FrameParticles, FramesSeveralCloudsTogether) {
  const Particles a = RandomCloud({-3, 0, 0}, {1, 1, 1});
  const Particles b = RandomCloud({3, 4, 0}, {1, 1, 1});
  const View view = FrameParticles({&a, &b}, 1, {}, {});
  const double margin_a = Project(a, 1, view, {0, 1, 0}, {}).Margin();
  const double margin_b = Project(b, 1, view, {0, 1, 0}, {}).Margin();
  EXPECT_NEAR(std::min(margin_a, margin_b), 0.08, 1e-6);
}

TEST(FrameParticles, KeepsWhatTheUserFixed) {
  const Particles cloud = RandomCloud({5, 0, 0}, {1, 1, 1});
  const View from_eye = FrameParticles({&cloud}, 1, {}, {Vec3{0, 0, 9}, {}, {0, 1, 0}});
  EXPECT_EQ(from_eye.eye, (Vec3{0, 0, 9}));
  EXPECT_NEAR(from_eye.target[0], 5, 0.1);
  const View at_target = FrameParticles({&cloud}, 1, {}, {{}, Vec3{4, 1, 0}, {0, 1, 0}});
  EXPECT_EQ(at_target.target, (Vec3{4, 1, 0}));
  EXPECT_NEAR(Project(cloud, 1, at_target, {0, 1, 0}, {}).Margin(), 0.08, 1e-6);
}

TEST(FrameParticles, FindsAViewWithoutParticles) {
  const Particles none;
  const View view = FrameParticles({&none}, 1, {}, {});
  EXPECT_GT(Dot(Minus(view.eye, view.target), Minus(view.eye, view.target)), 1);
  const View parallel = FrameParticles({&none}, 1, {1, 40, true}, {});
  EXPECT_GT(parallel.orthographic_height, 0);
  const View fixed = FrameParticles({&none}, 1, {}, {Vec3{1, 2, 3}, {}, {0, 1, 0}});
  EXPECT_EQ(fixed.eye, (Vec3{1, 2, 3}));
  EXPECT_NE(fixed.target, fixed.eye);
}

TEST(FrameParticles, LooksAlongUpWhereItHasTo) {
  const Particles cloud = RandomCloud({0, 0, 0}, {1, 1, 1});
  const View view = FrameParticles({&cloud}, 1, {}, {Vec3{0, 9, 0}, Vec3{0, 0, 0}, {0, 1, 0}});
  EXPECT_TRUE(std::isfinite(view.orthographic_height));
  const Vec3 light = SideLight(view, {0, 1, 0});
  EXPECT_NEAR(Dot(light, light), 1, 1e-12);
}

TEST(EstimateRadius, SuitsThePlume) {
  for (const char* frame : {"0024", "0032", "0040"}) {
    const auto plume =
        ReadParticles(std::string(HALFLIGHT_TEST_DATA "/plume/plume.") + frame + ".ply");
    ASSERT_TRUE(plume.ok());
    const double radius = EstimateRadius(*plume);
    EXPECT_GT(radius, 0.037) << frame;
    EXPECT_LT(radius, 0.053) << frame;
  }
}

TEST(EstimateRadius, GrowsWithTheCloud) {
  Particles particles = RandomCloud({0, 0, 0}, {1, 1, 1});
  const double radius = EstimateRadius(particles);
  for (float& value : particles.positions) {
    value *= 1000;
  }
  EXPECT_NEAR(EstimateRadius(particles), 1000 * radius, 1e-3 * 1000 * radius);
}

TEST(EstimateRadius, IsPositiveForDegenerateClouds) {
  Particles particles;
  EXPECT_EQ(EstimateRadius(particles), 1);
  particles.positions = {1, 2, 3};
  EXPECT_EQ(EstimateRadius(particles), 1);
  particles.positions = {1, 2, 3, 1, 2, 3};
  EXPECT_EQ(EstimateRadius(particles), 1);
  particles.positions = {0, 0, 0, 2, 0, 0};
  EXPECT_GT(EstimateRadius(particles), 0.5);
  // Many in one place, and one elsewhere.
  particles.positions.assign(300, 0.0F);
  particles.positions.back() = 50;
  EXPECT_DOUBLE_EQ(EstimateRadius(particles), 0.5);
}

TEST(SideLight, ComesFromTheUpperLeftOfTheView) {
  const View view{{0, 0, 5}, {0, 0, 0}, 0};
  const Vec3 direction = SideLight(view, {0, 1, 0});
  EXPECT_GT(direction[0], 0.3);   // travels to the right,
  EXPECT_LT(direction[1], -0.3);  // downward,
  EXPECT_LT(direction[2], 0);     // and away from the eye
  EXPECT_NEAR(Dot(direction, direction), 1, 1e-12);
}

}  // namespace
}  // namespace halflight::client
