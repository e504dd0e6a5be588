// The path tracer against what is known in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include <glm/geometric.hpp>

#include "tests/monte_carlo/estimate.h"
#include "tests/monte_carlo/slab.h"

namespace halflight::monte_carlo {
namespace {

constexpr uint64_t kSeed = 20261122;
// Of normal errors one in 15,000 lies further out, and seeds are fixed.
constexpr double kSigmas = 4.0;

// Says what was found, and holds it to what is expected within its own standard error.
void ExpectMean(const char* name, const Mean& mean, double expected) {
  std::cout << name << ": " << mean.value() << " +- " << mean.standard_error() << ", expected "
            << expected << " (seed " << kSeed << ")\n";
  EXPECT_NEAR(mean.value(), expected, kSigmas * mean.standard_error() + 1e-12) << name;
}

reference::Particle ParticleAt(const glm::dvec3& center, double radius, double optical_depth) {
  return {center, radius, optical_depth, glm::dvec3(1.0), glm::dvec3(0.0)};
}

// Three balls that overlap, of different radius and depth.
reference::Cloud ThreeBalls(Profile profile) {
  reference::Cloud cloud;
  cloud.profile = profile;
  cloud.particles = {ParticleAt({0.1, 0.0, 0.0}, 0.8, 0.7), ParticleAt({-0.3, 0.2, 0.6}, 0.5, 1.1),
                     ParticleAt({0.2, -0.1, -0.4}, 1.0, 0.4)};
  return cloud;
}

class ParticleMediumOf : public testing::TestWithParam<Profile> {};

TEST_P(ParticleMediumOf, ProjectsToTheOpticalDepthOfTheImageModel) {
  // Integrates across the chord by the midpoint rule in the angle t of z = half * sin(t), in which
  // the integrand is smooth.
  const reference::Particle particle = ParticleAt(glm::dvec3(0.0), 0.7, 1.3);
  for (const double impact : {0.0, 0.2, 0.5, 0.69}) {
    const double half = std::sqrt(0.49 - impact * impact);
    constexpr int kSteps = 2000;
    double depth = 0.0;
    for (int step = 0; step < kSteps; ++step) {
      const double t = M_PI * ((step + 0.5) / kSteps - 0.5);
      const double z = half * std::sin(t);
      depth += Extinction(particle, GetParam(), impact * impact + z * z) * half * std::cos(t) *
               M_PI / kSteps;
    }
    EXPECT_NEAR(depth, reference::OpticalDepthAt(particle, GetParam(), impact * impact), 1e-5);
  }
}

TEST_P(ParticleMediumOf, LetsThroughWhatTheOpticalDepthOfARaySays) {
  const reference::Cloud cloud = ThreeBalls(GetParam());
  const ParticleMedium medium(cloud, 1.5);
  Random random(kSeed);
  const glm::dvec3 rays[] = {{0.0, 0.0, -1.0}, {0.3, -0.2, -1.0}, {-0.2, 0.5, 0.3}};
  for (const glm::dvec3& ray : rays) {
    const glm::dvec3 direction = glm::normalize(-ray);
    const glm::dvec3 start = 5.0 * ray / glm::length(ray) + glm::dvec3(0.1, 0.05, 0.0);
    double depth = 0.0;
    for (const reference::Particle& particle : cloud.particles) {
      const glm::dvec3 moment = glm::cross(particle.center - start, direction);
      depth += 1.5 * reference::OpticalDepthAt(particle, GetParam(), glm::dot(moment, moment));
    }
    Mean through;
    for (int n = 0; n < 100000; ++n) {
      bool left = false;
      Follow(medium, {0.0, 0.0}, {start, direction}, random,
             [&](const Photon&, const ParticleMedium::Flight&, bool leaves) {
               left = leaves;
               return true;
             });
      through.Add(left ? 1.0 : 0.0);
    }
    ExpectMean("transmittance", through, std::exp(-depth));
  }
}

// The area that a particle of this depth makes opaque: the integral of 1 - exp(-tau w).
double OpaqueArea(double radius, double optical_depth, Profile profile) {
  const double t = optical_depth;
  const double share = profile == Profile::kSoft
                           ? 1.0 - (1.0 - std::exp(-t)) / t
                           : 1.0 - 2.0 * (1.0 - (1.0 + t) * std::exp(-t)) / (t * t);
  return M_PI * radius * radius * share;
}

TEST_P(ParticleMediumOf, GivesTwoParticlesInARowTheLightThatTheyAbsorb) {
  reference::Cloud cloud;
  cloud.profile = GetParam();
  const glm::dvec3 direction = glm::normalize(glm::dvec3(1.0, 2.0, -0.5));
  cloud.particles = {ParticleAt(glm::dvec3(0.2), 0.5, 0.9),
                     ParticleAt(glm::dvec3(0.2) + 1.5 * direction, 0.5, 0.9)};
  const LightEstimate light =
      EstimateLight(ParticleMedium(cloud, 2.0), {0.0, 0.0}, direction, 400000, kSeed);
  const double once = OpaqueArea(0.5, 1.8, GetParam());
  const double whole = 2.0 * CrossSection(cloud.particles[0], GetParam());
  const double expected[] = {once / whole, (OpaqueArea(0.5, 3.6, GetParam()) - once) / whole};
  for (const ParticleLight& half : {light.a, light.b}) {
    for (size_t i = 0; i < 2; ++i) {
      std::cout << "light at particle " << i << ": " << half.fluence[i] << ", expected "
                << expected[i] << "\n";
      EXPECT_NEAR(half.fluence[i], expected[i], 0.02 * expected[i]);
      EXPECT_NEAR(half.forward_flux[i], half.fluence[i], 1e-9);
    }
  }
  EXPECT_NE(light.a.fluence[1], light.b.fluence[1]);
}

INSTANTIATE_TEST_SUITE_P(Profiles, ParticleMediumOf,
                         testing::Values(Profile::kSoft, Profile::kBall), [](const auto& param) {
                           return param.param == Profile::kSoft ? "Soft" : "Ball";
                         });

TEST(Scattered, HasTheMeanCosineAndTheSecondMomentOfHenyeyAndGreenstein) {
  Random random(kSeed);
  const glm::dvec3 direction = glm::normalize(glm::dvec3(0.3, -0.5, 0.7));
  for (const double g : {-0.4, 0.0, 0.5, 0.8, 0.9}) {
    Mean cosine;
    Mean second;  // Legendre polynomial P2, of which the mean is g^2
    for (int n = 0; n < 200000; ++n) {
      const double c = glm::dot(direction, Scattered(direction, g, random));
      cosine.Add(c);
      second.Add(1.5 * c * c - 0.5);
    }
    ExpectMean("mean cosine", cosine, g);
    ExpectMean("mean P2", second, g * g);
  }
}

TEST(Slab, HasTheMeanFreePathOfItsExtinction) {
  Random random(kSeed);
  const Slab medium{.extinction = 2.5};
  Mean path;
  Slab::Flight flight;
  for (int n = 0; n < 200000; ++n) {
    medium.Fly({glm::dvec3(0.0), {0.0, 0.0, 1.0}}, random, flight);
    path.Add(flight.length);
  }
  ExpectMean("mean free path", path, 0.4);
}

TEST(Slab, ReturnsAllLightThatItDoesNotAbsorb) {
  Random random(kSeed);
  const Slab medium{.extinction = 1.0, .thickness = 4.0};
  double forward = 0.0;
  double back = 0.0;
  constexpr int kPhotons = 20000;
  for (int n = 0; n < kPhotons; ++n) {
    Follow(medium, {0.8, 1.0}, {glm::dvec3(0.0), {0.0, 0.0, 1.0}}, random,
           [&](const Photon& photon, const Slab::Flight&, bool leaves) {
             if (leaves) (photon.direction.z > 0.0 ? forward : back) += photon.weight;
             return true;
           });
  }
  EXPECT_EQ(forward + back, kPhotons);
  EXPECT_GT(back, 0.02 * kPhotons);
}

// Depth 2, albedo 0.9, g = 0.75, light at right angles: van de Hulst 1980, "Multiple Light
// Scattering", as quoted by Wang, Jacques and Zheng 1995, "MCML", table 1.
TEST(Slab, ReflectsAndTransmitsWhatTheTablesSay) {
  Random random(kSeed);
  const Slab medium{.extinction = 1.0, .thickness = 2.0};
  Mean forward;
  Mean back;
  for (int n = 0; n < 400000; ++n) {
    double through = 0.0;
    double returned = 0.0;
    Follow(medium, {0.75, 0.9}, {glm::dvec3(0.0), {0.0, 0.0, 1.0}}, random,
           [&](const Photon& photon, const Slab::Flight&, bool leaves) {
             if (leaves) (photon.direction.z > 0.0 ? through : returned) = photon.weight;
             return true;
           });
    forward.Add(through);
    back.Add(returned);
  }
  ExpectMean("transmitted", forward, 0.66096);
  ExpectMean("reflected", back, 0.09739);
}

}  // namespace
}  // namespace halflight::monte_carlo
