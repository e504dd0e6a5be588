// The light buffer's scattering against Monte Carlo.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <glm/geometric.hpp>

#include "renderer/frame.h"
#include "renderer/particle_order.h"
#include "renderer/scattering.h"
#include "tests/monte_carlo/estimate.h"
#include "tests/oracle/plume.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight {
namespace {

struct Judgement {
  double relative_rmse = 0.0;
  double bias = 0.0;
};

class ScatteredLight : public test::GlTest {
 protected:
  static std::vector<glm::dvec3> Samples(Profile profile) {
    std::vector<glm::dvec3> s;
    monte_carlo::Random random(5);
    while (s.size() < 32) {
      const glm::dvec3 p(2 * random.Uniform() - 1, 2 * random.Uniform() - 1, 2 * random.Uniform() - 1);
      const double inside = 1.0 - glm::dot(p, p);
      if (inside <= 0.0) continue;
      if (profile == Profile::kSoft && random.Uniform() > std::sqrt(inside)) continue;
      s.push_back(p);
    }
    return s;
  }

  static std::vector<double> LightAtParticles(const Scene& scene) {
    const FrameResult frame = Render({scene, {{ImageKind::kLightLayers, 0, LightQuantity::kTransmittance}}});
    const Image& layers = frame.images[0];
    const ParticleView particles(scene);
    const ParticleOrder order = OrderParticles(particles, frame.plan.traversals[0], {});
    const glm::dvec3 axis = *frame.plan.traversals[0].axis;
    const glm::dvec3 center = particles.bounds().center();
    const auto coordinate = [&](size_t i) {
      return glm::dot(glm::dvec3(particles.positions()[i]) - center, axis);
    };
    std::vector<double> ends;
    for (size_t s = 0; s + 1 < order.slice_begin.size(); ++s) {
      const uint32_t end = order.slice_begin[s + 1];
      const double last = coordinate(order.particles[end - 1].index);
      ends.push_back(end < particles.size() ? 0.5 * (last + coordinate(order.particles[end].index)) : last);
    }
    const double begin = coordinate(order.particles[0].index);
    const glm::dmat4& texture = frame.lights[0].light_texture_from_world;
    const auto depth_at = [&](size_t layer, const glm::dvec2& at) {
      const glm::dvec2 p = at * glm::dvec2(layers.width, layers.height) - 0.5;
      const glm::ivec2 f = glm::clamp(glm::ivec2(glm::floor(p)), glm::ivec2(0), glm::ivec2(layers.width - 2, layers.height - 2));
      const glm::dvec2 t = glm::clamp(p - glm::dvec2(f), 0.0, 1.0);
      const float* row = &layers.pixels[(layer * layers.height + f.y) * layers.width + f.x];
      const float* row2 = row + layers.width;
      return (row[0] * (1 - t.x) + row[1] * t.x) * (1 - t.y) + (row2[0] * (1 - t.x) + row2[1] * t.x) * t.y;
    };
    const std::vector<glm::dvec3> samples = Samples(scene.material.profile);
    std::vector<double> light(particles.size());
    for (size_t i = 0; i < particles.size(); ++i) {
      for (const glm::dvec3& sample : samples) {
        const glm::dvec3 p = glm::dvec3(particles.positions()[i]) + sample * double(particles.radius(i));
        const double z = glm::dot(p - center, axis);
        const size_t layer = std::upper_bound(ends.begin(), ends.end(), z) - ends.begin();
        const glm::dvec4 at = texture * glm::dvec4(p + particles.set().origin, 1.0);
        const glm::dvec2 place = glm::dvec2(at) / at.w;
        if (layer == ends.size()) {
          light[i] += depth_at(layer - 1, place);
          continue;
        }
        const double from = layer == 0 ? begin : ends[layer - 1];
        const double t = std::clamp((z - from) / (ends[layer] - from), 0.0, 1.0);
        const double before = layer == 0 ? 1.0 : depth_at(layer - 1, place);
        const double after = depth_at(layer, place);
        light[i] += std::exp((1 - t) * std::log(std::max(before, 1e-30)) + t * std::log(std::max(after, 1e-30)));
      }
      light[i] /= samples.size();
    }
    return light;
  }

  static Judgement Judge(const std::vector<double>& model, const std::vector<double>& a, const std::vector<double>& b) {
    double squares = 0, diff = 0, mean = 0;
    for (size_t i = 0; i < model.size(); ++i) {
      squares += (model[i] - a[i]) * (model[i] - b[i]);
      diff += model[i] - 0.5 * (a[i] + b[i]);
      mean += 0.5 * (a[i] + b[i]);
    }
    const double n = model.size();
    return {std::sqrt(std::max(squares / n, 0.0)) / (mean / n), diff / mean};
  }
};

TEST_F(ScatteredLight, Explore) {
  Scene scene;
  scene.particles = oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  const glm::dvec3 travel = glm::normalize(glm::dvec3(1, -0.6, -0.4));
  scene.camera = test::LookAt(-6.0 * travel, {0, 0, 0}, 16, 16);
  scene.lights = {test::Sun(travel, std::getenv("K") ? atof(std::getenv("K")) : 1.0)};
  scene.material.radius = 0.045F;
  scene.material.opacity = 0.18F;
  scene.shadow.slices = 128;
  scene.shadow.light_buffer_size = 256;
  const size_t photons = std::getenv("N") ? atoi(std::getenv("N")) : 100000;
  const reference::Cloud cloud = reference::ResolveCloud(scene);
  const monte_carlo::ParticleMedium medium(cloud, scene.lights[0].shadow_density.x);
  const double albedo = std::getenv("W") ? atof(std::getenv("W")) : 0.9;
  for (const double g : {-1.0, 0.5, 0.8, 0.9}) {
    const double w = g < 0 ? 0.0 : albedo;
    const auto light = monte_carlo::EstimateLight(medium, {std::max(g, 0.0), w}, travel, photons, 3);
    double flux = 0, ffl = 0, all = 0;
    for (size_t i = 0; i < cloud.particles.size(); ++i) {
      flux += light.a.forward_flux[i];
      ffl += light.a.forward_fluence[i];
      all += light.a.fluence[i];
    }
    const double n = cloud.particles.size();
    std::printf("g %.1f albedo %.2f mean forward flux %.4f forward fluence %.4f fluence %.4f\n", g, w, flux / n, ffl / n, all / n);
    const auto report = [&](const char* name, const std::vector<double>& m) {
      const Judgement f = Judge(m, light.a.forward_flux, light.b.forward_flux);
      const Judgement ff = Judge(m, light.a.forward_fluence, light.b.forward_fluence);
      const Judgement fl = Judge(m, light.a.fluence, light.b.fluence);
      std::printf("  %-24s flux rmse %.3f bias %+.3f   ffluence %.3f %+.3f   fluence %.3f %+.3f\n", name, f.relative_rmse, f.bias, ff.relative_rmse, ff.bias, fl.relative_rmse, fl.bias);
      std::fflush(stdout);
    };
    Scene s = scene;
    report("none", LightAtParticles(s));
    if (g < 0) continue;
    s.material.physical_scattering = PhysicalScattering{float(g), float(albedo)};
    report("physical", LightAtParticles(s));
    for (const float shrink : {0.5F, 0.25F}) {
      (void)shrink;
    }
    s.material.physical_scattering.reset();
    s.lights[0].shadow_density = scene.lights[0].shadow_density * float(ForwardExtinction({float(g), float(albedo)}));
    report("k_eff without blur", LightAtParticles(s));
    s.lights[0].shadow_density = scene.lights[0].shadow_density;
    for (const float spread : {0.05F, 0.1F, 0.2F, 0.4F}) {
      s.material.scattering_spread = spread;
      report(("artistic " + std::to_string(spread)).c_str(), LightAtParticles(s));
    }
  }
}

}  // namespace
}  // namespace halflight
