// A thin beam in a homogeneous medium: how far it spreads, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include <glm/geometric.hpp>

#include "tests/monte_carlo/estimate.h"
#include "tests/monte_carlo/slab.h"

namespace halflight::monte_carlo {
namespace {

constexpr uint64_t kSeed = 31;

// Small angles, Fermi and Eyges: b (1 - g^2) s^3 / 9 for b = 1.
double SmallAngle(double g, double s) { return (1.0 - g * g) * s * s * s / 9.0; }

// The variance across the beam, along one axis, of light that has travelled a path of length s with
// b = 1: Lewis 1950, eq. 26, whose integrals for Henyey and Greenstein's phase function (moments g
// and g^2) are elementary.
double Lewis(double g, double s) {
  const double k1 = 1.0 - g;
  const double k2 = 1.0 - g * g;
  const double until1 = (1.0 - std::exp(-k1 * s)) / k1;
  const double until2 = (1.0 - std::exp(-k2 * s)) / k2;
  return 2.0 / 3.0 * ((s - until1) / k1 - (until1 - until2) / (k2 - k1));
}

// The mean of (x^2 + y^2) / 2 after a path of length s, b = 1; the beam starts at the origin.
Mean TracedByPath(double g, double s, int photons) {
  Random random(kSeed);
  const Slab medium{.extinction = 1.0};
  Mean mean;
  for (int n = 0; n < photons; ++n) {
    double path = 0.0;
    Follow(medium, {g, 1.0}, {glm::dvec3(0.0), {0.0, 0.0, 1.0}}, random,
           [&](const Photon& photon, const Slab::Flight& flight, bool /*leaves*/) {
             if (path + flight.length < s) {
               path += flight.length;
               return true;
             }
             const glm::dvec3 end = photon.position + (s - path) * photon.direction;
             mean.Add(0.5 * (end.x * end.x + end.y * end.y));
             return false;
           });
  }
  return mean;
}

TEST(Beam, SpreadsWithItsPathAsTheMomentEquationsSay) {
  std::printf("lateral variance by length of path s, in units of s^2; b = 1, seed %llu\n",
              static_cast<unsigned long long>(kSeed));
  std::printf("   g    s   traced              Lewis      small angles (off by)\n");
  for (const double g : {0.5, 0.8, 0.9}) {
    for (const double s : {0.1, 0.5, 1.0, 4.0}) {
      const Mean traced = TracedByPath(g, s, 200000);
      const double exact = Lewis(g, s);
      std::printf("%4.1f %4.1f   %.5f +- %.5f   %.5f   %.5f (%+.1f %%)\n", g, s,
                  traced.value() / (s * s), traced.standard_error() / (s * s), exact / (s * s),
                  SmallAngle(g, s) / (s * s), 100.0 * (SmallAngle(g, s) / exact - 1.0));
      EXPECT_NEAR(traced.value(), exact, 4.0 * traced.standard_error()) << g << " " << s;
    }
  }
}

TEST(Beam, TendsToTheSmallAngleFormulaAtSmallDepth) {
  for (const double g : {0.5, 0.8, 0.9}) {
    // The next term of the series: 1 - (2 - g - g^2) s / 4.
    for (const double s : {0.01, 0.1}) {
      const double next = 1.0 - 0.25 * (2.0 - g - g * g) * s;
      EXPECT_NEAR(Lewis(g, s) / SmallAngle(g, s), next, 0.2 * s * s) << g << " " << s;
    }
  }
}

// Light that crosses a plane at depth s forward is no Gaussian of that variance: a part of it has
// not been scattered and lies in one point, another part lies far out (one scattering at nearly
// right angles reaches as far as one likes), and most lies nearer than the deviation tells.
TEST(Beam, AtADepthIsAPointWithTailsAndNoGaussian) {
  constexpr int kPhotons = 100000;
  std::printf("light crossing the plane at depth s = 1 / b forward, for the first time\n");
  std::printf(
      "   g  in the point  beyond the formula's deviation  variance within s of the axis\n");
  for (const double g : {0.5, 0.8, 0.9}) {
    Random random(kSeed);
    const Slab medium{.extinction = 1.0, .thickness = 1.0};
    const double deviation = std::sqrt(SmallAngle(g, 1.0));
    Mean in_point;
    Mean beyond;
    Mean within;
    for (int n = 0; n < kPhotons; ++n) {
      Follow(medium, {g, 1.0}, {glm::dvec3(0.0), {0.0, 0.0, 1.0}}, random,
             [&](const Photon& photon, const Slab::Flight& flight, bool leaves) {
               if (!leaves || photon.direction.z <= 0.0) return true;
               const glm::dvec2 place(flight.end);
               in_point.Add(place == glm::dvec2(0.0) ? 1.0 : 0.0);
               beyond.Add(std::abs(place.x) > deviation ? 1.0 : 0.0);
               if (glm::length(place) < 1.0) within.Add(0.5 * glm::dot(place, place));
               return true;
             });
    }
    const double forward = static_cast<double>(in_point.count()) / kPhotons;
    std::printf("%4.1f  %.3f         %.3f (a Gaussian: 0.317)           %.4f (formula: %.4f)\n", g,
                in_point.value(), beyond.value(), within.value(), SmallAngle(g, 1.0));
    EXPECT_NEAR(in_point.value() * forward, std::exp(-1.0), 4.0 * in_point.standard_error());
    EXPECT_LT(beyond.value(), 0.29);
    EXPECT_LT(within.value(), 0.95 * SmallAngle(g, 1.0));
  }
}

}  // namespace
}  // namespace halflight::monte_carlo
