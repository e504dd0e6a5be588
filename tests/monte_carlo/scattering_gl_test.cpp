// Scattered light as the light buffer holds it, with both modes and with none, against path
// tracing: the figures of docs/scattering.md. With HALFLIGHT_SCATTERING_LONG=1 in the environment
// also the artistic settings that fit best, more light, a denser plume and other albedos: minutes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <string>
#include <tuple>

#include <glm/geometric.hpp>

#include "tests/monte_carlo/buffered_light.h"
#include "tests/monte_carlo/estimate.h"
#include "tests/oracle/plume.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

using monte_carlo::LightEstimate;

constexpr uint64_t kSeed = 3;

bool LongForm() {
  const char* const value = std::getenv("HALFLIGHT_SCATTERING_LONG");
  return value != nullptr && std::string(value) == "1";
}

struct LightError {
  double relative_rmse;
  double standard_error;  // of relative_rmse
  double bias;            // relative
};

// What the particles' light is compared by: means over cubes of this edge, as an image shows
// particles over one another, of those particles that `counts`.
struct Comparison {
  double cube = 0.0;
  bool (*counts)(const glm::vec3&) = [](const glm::vec3&) { return true; };
};

// The squared error is the mean of (model - a) (model - b), in which the noise of the two
// independent estimates has no share.
LightError Compare(const Scene& scene, const std::vector<double>& model,
                   const std::vector<double>& a, const std::vector<double>& b,
                   const Comparison& by) {
  struct Sums {
    double count = 0.0;
    double model = 0.0;
    double a = 0.0;
    double b = 0.0;
  };
  std::map<std::tuple<int, int, int>, Sums> cubes;
  const std::vector<glm::vec3>& positions = scene.particles->positions;
  for (size_t i = 0; i < positions.size(); ++i) {
    if (!by.counts(positions[i])) continue;
    const glm::ivec3 cube(glm::floor(glm::dvec3(positions[i]) / by.cube));
    Sums& sums = cubes[{cube.x, cube.y, cube.z}];
    sums.count += 1.0;
    sums.model += model[i];
    sums.a += a[i];
    sums.b += b[i];
  }
  Sums all;
  double squares = 0.0;
  double squared_squares = 0.0;
  for (const auto& [cube, sums] : cubes) {
    const double square = (sums.model - sums.a) * (sums.model - sums.b) / sums.count;
    squares += square;
    squared_squares += square * square;
    all.count += sums.count;
    all.model += sums.model;
    all.a += sums.a;
    all.b += sums.b;
  }
  const double mean = 0.5 * (all.a + all.b) / all.count;
  const double relative_rmse = std::sqrt(std::max(squares, 0.0) / all.count) / mean;
  return {relative_rmse,
          0.5 * std::sqrt(squared_squares) / all.count / (relative_rmse * mean * mean),
          all.model / all.count / mean - 1.0};
}

class ScatteredLight : public test::GlTest {
 protected:
  // Looks along the light, so that slices lie across it.
  static Scene SceneAlong(const glm::dvec3& travel, std::shared_ptr<const ParticleSet> particles) {
    Scene scene;
    scene.particles = std::move(particles);
    scene.camera = test::LookAt(-9.0 * travel, {0, 0, 0}, 16, 16);
    scene.lights = {test::Sun(travel)};
    scene.shadow.slices = 64;
    scene.shadow.light_buffer_size = 160;
    return scene;
  }

  static std::vector<double> Light(const Scene& scene) {
    return monte_carlo::LightAtParticles(
        scene, Render({scene, {{ImageKind::kLightLayers, 0, LightQuantity::kTransmittance}}}));
  }

  static LightEstimate Trace(const Scene& scene, const monte_carlo::Scatterer& scatterer,
                             size_t photons) {
    const reference::Cloud cloud = reference::ResolveCloud(scene);
    const monte_carlo::ParticleMedium medium(cloud, scene.lights[0].shadow_density.x);
    return EstimateLight(medium, scatterer,
                         std::get<DirectionalLight>(scene.lights[0].kind).direction, photons,
                         kSeed);
  }

  static Scene WithPhysical(Scene scene, double g, double albedo) {
    scene.material.physical_scattering =
        PhysicalScattering{static_cast<float>(g), static_cast<float>(albedo)};
    return scene;
  }

  static Scene WithArtistic(Scene scene, double spread, double density_scale) {
    scene.material.scattering_spread = static_cast<float>(spread);
    scene.lights[0].shadow_density *= static_cast<float>(density_scale);
    return scene;
  }
};

// A medium, and the artist's settings that come nearest to it: found by the long form.
struct JudgedCase {
  double g;
  double albedo;
  double spread;
  double density;        // times the true one
  double physical_rmse;  // relative; at most
};

// How far models of the light are from the traced one, printed as docs/scattering.md has it: by the
// forward flux, which the light buffer stands for, and by the fluence, which it does not.
class Judge {
 public:
  Judge(Scene scene, LightEstimate light, Comparison by)
      : scene_(std::move(scene)), light_(std::move(light)), by_(by) {}

  [[nodiscard]] LightError Of(const std::vector<double>& model) const {
    return Compare(scene_, model, light_.a.forward_flux, light_.b.forward_flux, by_);
  }

  LightError Report(const char* name, const std::vector<double>& model) const {
    const LightError flux = Of(model);
    const LightError fluence = Compare(scene_, model, light_.a.fluence, light_.b.fluence, by_);
    std::printf("  %-36s %6.1f +- %.1f %% (bias %+5.1f %%); of fluence %6.1f %% (%+5.1f %%)\n",
                name, 100.0 * flux.relative_rmse, 100.0 * flux.standard_error, 100.0 * flux.bias,
                100.0 * fluence.relative_rmse, 100.0 * fluence.bias);
    std::fflush(stdout);
    return flux;
  }

 private:
  Scene scene_;
  LightEstimate light_;
  Comparison by_;
};

class JudgedLight : public ScatteredLight {
 protected:
  // The artistic settings of a grid that come nearest, with the true density and with any.
  static void PrintBestFit(const Judge& judge, const Scene& scene) {
    for (const bool any_density : {false, true}) {
      double least = std::numeric_limits<double>::infinity();
      std::string settings;
      for (const double spread : {0.0, 0.05, 0.1, 0.2, 0.4}) {
        for (const double density : {1.0, 0.5, 0.35, 0.25, 0.18, 0.12}) {
          if (any_density == (density == 1.0)) continue;
          const LightError error = judge.Of(Light(WithArtistic(scene, spread, density)));
          if (error.relative_rmse >= least) continue;
          least = error.relative_rmse;
          settings = "spread " + std::to_string(spread) + ", density " + std::to_string(density);
        }
      }
      std::printf("  best of the grid: %s: %.1f %%\n", settings.c_str(), 100.0 * least);
      std::fflush(stdout);
    }
  }

  // `floor`: how far the light buffer is from a medium that does not scatter, at most.
  static void JudgeScene(const char* name, const Scene& scene, const Comparison& by,
                         const std::vector<JudgedCase>& cases, size_t photons, double floor) {
    const double density = scene.lights[0].shadow_density.x;
    const std::vector<double> unscattered = Light(scene);
    std::printf("%s, density %.1f, absorption only, seed %d\n", name, density,
                static_cast<int>(kSeed));
    const Judge absorbing(scene, Trace(scene, {0.0, 0.0}, photons), by);
    EXPECT_LT(absorbing.Report("no scattering", unscattered).relative_rmse, floor);
    for (const JudgedCase& c : cases) {
      std::printf("%s, density %.1f, g %.1f, albedo %.2f\n", name, density, c.g, c.albedo);
      const Judge judge(scene, Trace(scene, {c.g, c.albedo}, photons), by);
      const LightError none = judge.Report("no scattering", unscattered);
      judge.Report("artistic, spread and density fitted",
                   Light(WithArtistic(scene, c.spread, c.density)));
      const LightError physical =
          judge.Report("physical", Light(WithPhysical(scene, c.g, c.albedo)));
      Scene swept = WithPhysical(scene, c.g, c.albedo);
      swept.shadow.technique = ShadowTechniqueKind::kLightSweep;
      const LightError of_sweep = judge.Report("physical, light sweep", Light(swept));
      EXPECT_NEAR(of_sweep.relative_rmse, physical.relative_rmse, 0.01);
      EXPECT_LT(of_sweep.relative_rmse, c.physical_rmse);
      EXPECT_LT(physical.relative_rmse, c.physical_rmse);
      EXPECT_LT(physical.relative_rmse, 0.5 * none.relative_rmse);
      EXPECT_LT(std::abs(physical.bias), 0.5 * std::abs(none.bias));
      if (LongForm()) PrintBestFit(judge, scene);
    }
  }
};

Scene PlumeScene(Scene scene, double density) {
  scene.material.radius = 0.045F;
  scene.material.opacity = 0.18F;
  scene.lights[0].shadow_density = glm::vec3(static_cast<float>(density));
  return scene;
}

TEST_F(JudgedLight, InThePlumeIsThatOfThePhysicalMode) {
  const auto particles =
      oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  ASSERT_NE(particles, nullptr);
  const Scene scene = SceneAlong(glm::normalize(glm::dvec3(1.0, -0.6, -0.4)), particles);
  const Comparison by{.cube = 0.09};
  constexpr size_t kPhotons = 60000;
  JudgeScene(
      "plume", PlumeScene(scene, 0.2), by,
      {{0.5, 0.9, 0.0, 0.35, 0.22}, {0.8, 0.9, 0.0, 0.25, 0.22}, {0.9, 0.9, 0.0, 0.18, 0.22}},
      kPhotons, 0.2);
  if (!LongForm()) return;
  JudgeScene("plume", PlumeScene(scene, 1.0), by,
             {{0.5, 0.9, 0.0, 0.35, 0.35}, {0.8, 0.9, 0.0, 0.25, 0.45}, {0.9, 0.9, 0.0, 0.18, 0.4}},
             kPhotons, 0.65);
  JudgeScene("plume", PlumeScene(scene, 0.2), by,
             {{0.8, 0.5, 0.0, 0.5, 0.15}, {0.8, 1.0, 0.0, 0.12, 0.25}}, kPhotons, 0.2);
}

// A wide homogeneous layer, one unit deep, behind the edge of an opaque screen.
std::shared_ptr<const ParticleSet> EdgeAndLayer(double layer_depth) {
  auto set = std::make_shared<ParticleSet>();
  const auto add = [&](const glm::dvec3& place, double radius, double optical_depth) {
    set->positions.emplace_back(place);
    set->radii.push_back(static_cast<float>(radius));
    set->opacities.push_back(static_cast<float>(-std::expm1(-optical_depth)));
  };
  for (double x = -1.95; x < 0.0; x += 0.05) {
    for (double y = -1.98; y < 2.0; y += 0.05) add({x, y, -0.2}, 0.06, 12.0);
  }
  constexpr int kParticles = 10000;
  constexpr double kRadius = 0.1;
  constexpr double kArea = 4.0 * 4.0;
  monte_carlo::Random random(9);
  for (int n = 0; n < kParticles; ++n) {
    const double x = 4.0 * random.Uniform() - 2.0;
    const double y = 4.0 * random.Uniform() - 2.0;
    add({x, y, random.Uniform()}, kRadius,
        layer_depth * kArea / (kParticles * 0.5 * M_PI * kRadius * kRadius));
  }
  return set;
}

TEST_F(JudgedLight, BehindAnEdgeIsThatOfThePhysicalMode) {
  const Scene scene = SceneAlong({0.0, 0.0, 1.0}, EdgeAndLayer(2.0));
  // The layer's middle, without what lies near its sides or the screen's.
  const Comparison by{.cube = 0.1, .counts = [](const glm::vec3& p) {
                        return std::abs(p.x) < 1.0F && std::abs(p.y) < 1.0F && p.z >= 0.0F;
                      }};
  JudgeScene(
      "edge", scene, by,
      {{0.5, 0.9, 0.1, 0.35, 0.13}, {0.8, 0.9, 0.05, 0.25, 0.13}, {0.9, 0.9, 0.05, 0.18, 0.13}},
      50000, 0.15);
}

}  // namespace
}  // namespace halflight
