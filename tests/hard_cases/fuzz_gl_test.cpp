// Random scenes against properties that hold of every scene, and renderers with a fault each
// against the property that must catch it.
// HALFLIGHT_FUZZ_SEED and HALFLIGHT_FUZZ_CASES choose which scenes, and how many.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/hard_cases/figure.h"
#include "tests/hard_cases/properties.h"
#include "tests/hard_cases/same_picture.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight::fuzz {
namespace {

uint64_t FromEnvironment(const char* name, uint64_t otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr || *value == '\0' ? otherwise : std::strtoull(value, nullptr, 10);
}

class Fuzz : public test::GlTest {
 protected:
  static FrameResult Sound(const FrameRequest& request) { return Render(request); }
};

// Where a property fails, all that it takes to see it again.
std::string Replay(const Property& property, uint64_t seed, uint64_t number, const Scene& scene) {
  std::ostringstream text;
  text << property.name << " in case " << number << " of HALFLIGHT_FUZZ_SEED=" << seed
       << " (set HALFLIGHT_FUZZ_CASES above " << number << "): " << Describe(scene);
  return text.str();
}

TEST_F(Fuzz, PropertiesHoldOfRandomScenes) {
  const uint64_t seed = FromEnvironment("HALFLIGHT_FUZZ_SEED", 1);
  const uint64_t cases = FromEnvironment("HALFLIGHT_FUZZ_CASES", 60);
  std::cout << "HALFLIGHT_FUZZ_SEED=" << seed << " HALFLIGHT_FUZZ_CASES=" << cases << "\n";
  // By property: where arithmetic bounds it, where the light buffer does.
  std::vector<std::array<double, 2>> largest(Properties().size());
  for (uint64_t number = 0; number < cases; ++number) {
    for (size_t p = 0; p < Properties().size(); ++p) {
      const Property& property = Properties()[p];
      Dice dice(seed, number);  // as if this were the only property
      const Scene scene = DrawScene(dice);
      const double deviation = property.deviation(Sound, scene, dice);
      const double bound = BoundOf(property, scene);
      double& most = largest[p][bound == property.bound ? 0 : 1];  // as a part of the bound
      most = std::max(most, bound > 0.0 ? deviation / bound : deviation);
      EXPECT_LE(deviation, bound) << Replay(property, seed, number, scene);
    }
  }
  for (size_t p = 0; p < Properties().size(); ++p) {
    const Property& property = Properties()[p];
    const double unit = property.bound > 0.0 ? property.bound : 1.0;
    test::PrintFigure("random scenes", property.name, largest[p][0] * unit, property.bound);
    if (property.bound_with_light_buffer == 0.0) continue;
    test::PrintFigure("random scenes, light buffers",
                      std::string(property.name) + " (of its bound)", largest[p][1], 1.0);
  }
}

// The light sweep's bound of a property: that of half-angle slicing, but where the fit of the light
// shows, or that a particle more shifts the chunks in which a tile is summed.
double SweepBoundOf(const Property& property, const Scene& scene) {
  const std::string name = property.name;
  if (name == "EqualsModel" || name == "BreaksTiesByIndex") return 0.4;
  if (name == "IgnoresTransparentParticles") return 1e-6;
  return BoundOf(property, scene);
}

TEST_F(Fuzz, PropertiesHoldOfTheLightSweep) {
  const uint64_t seed = FromEnvironment("HALFLIGHT_FUZZ_SEED", 1);
  const uint64_t cases = FromEnvironment("HALFLIGHT_FUZZ_CASES", 60);
  const auto swept = [](const FrameRequest& request) {
    FrameRequest changed = request;
    ShadowSettings& shadow = changed.scene.shadow;
    shadow.fit_degree = kMaxFitDegree;
    if (shadow.technique == ShadowTechniqueKind::kHalfAngle) {
      shadow.technique = ShadowTechniqueKind::kLightSweep;
    }
    return Render(changed);
  };
  for (const Property& property : Properties()) {
    double largest = 0.0;
    for (uint64_t number = 0; number < cases; ++number) {
      Dice dice(seed, number);
      const Scene scene = DrawScene(dice);
      const double deviation = property.deviation(swept, scene, dice);
      const double bound = SweepBoundOf(property, scene);
      largest = std::max(largest, bound > 0.0 ? deviation / bound : deviation);
      EXPECT_LE(deviation, bound) << Replay(property, seed, number, scene);
    }
    test::PrintFigure("random scenes, light sweep", std::string(property.name) + " (of its bound)",
                      largest, 1.0);
  }
}

// A renderer wrong in one way.
struct Fault {
  const char* name;
  const char* caught_by;
  std::function<FrameResult(const FrameRequest& request, const Render& sound)> render;
};

// The sound renderer's frame of a changed scene.
template <typename Change>
auto OfChangedScene(const Change& change) {
  return [change](const FrameRequest& request, const Render& sound) {
    FrameRequest changed = request;
    auto set = std::make_shared<ParticleSet>(*request.scene.particles);
    change(changed.scene, *set);
    changed.scene.particles = set;
    return sound(changed);
  };
}

// The sound frame with each image changed.
template <typename Change>
auto WithChangedImages(const Change& change) {
  return [change](const FrameRequest& request, const Render& sound) {
    FrameResult frame = sound(request);
    for (Image& image : frame.images) change(request.scene, image);
    return frame;
  };
}

const std::vector<Fault>& Faults() {
  static const std::vector<Fault> faults = {
      {"ShadowsOnePercentTooDense", "EqualsModel", OfChangedScene([](Scene& scene, ParticleSet&) {
         for (Light& light : scene.lights) light.shadow_density *= 1.01F;
       })},
      {"SlicesOnePercentTooDense", "EqualsModel", OfChangedScene([](Scene& scene, ParticleSet&) {
         if (scene.shadow.technique == ShadowTechniqueKind::kReference) return;
         for (Light& light : scene.lights) light.shadow_density *= 1.01F;
       })},
      {"ColorsNotPremultiplied", "EqualsModel", WithChangedImages([](const Scene&, Image& image) {
         for (size_t i = 0; image.channels.size() == 4 && i < image.pixels.size(); i += 4) {
           const float alpha = image.pixels[i + 3];
           for (size_t c = 0; alpha > 0.0F && c < 3; ++c) image.pixels[i + c] /= alpha;
         }
       })},
      {"BallsDrawnSoft", "EqualsModel",
       OfChangedScene([](Scene& scene, ParticleSet&) { scene.material.profile = Profile::kSoft; })},
      {"TiesByHigherIndex", "BreaksTiesByIndex", OfChangedScene([](Scene&, ParticleSet& set) {
         const auto reverse = [](auto& values) { std::reverse(values.begin(), values.end()); };
         reverse(set.positions);
         reverse(set.radii);
         reverse(set.opacities);
         reverse(set.colors);
         reverse(set.velocities);
         reverse(set.emissions);
       })},
      {"SkipsTheFirstParticle", "IgnoresOrderOfParticles",
       [](const FrameRequest& request, const Render& sound) {
         FrameRequest changed = request;
         changed.scene = test::WithOwnAttributes(request.scene);
         auto set = std::make_shared<ParticleSet>(*changed.scene.particles);
         set->opacities[0] = 0.0F;
         changed.scene.particles = set;
         return sound(changed);
       }},
      {"WindowShiftedByAPixel", "JoinsWindows", OfChangedScene([](Scene& scene, ParticleSet&) {
         if (scene.camera.window.x > 0) --scene.camera.window.x;
       })},
      {"WorldIn32Bits", "MovesWithTheWorld", OfChangedScene([](Scene& scene, ParticleSet& set) {
         set.origin = glm::vec3(set.origin);
         scene.camera.view_from_world = glm::mat4(scene.camera.view_from_world);
       })},
      {"RadiiOfAMillimetreAtLeast", "ScalesWithTheWorld",
       OfChangedScene([](Scene& scene, ParticleSet& set) {
         scene.material.radius = std::max(scene.material.radius, 1e-3F);
         for (float& radius : set.radii) radius = std::max(radius, 1e-3F);
       })},
      {"LightFromAboveOnly", "TurnsWithTheWorld", OfChangedScene([](Scene& scene, ParticleSet&) {
         for (Light& light : scene.lights) {
           auto* sun = std::get_if<DirectionalLight>(&light.kind);
           if (sun != nullptr) sun->direction.y = -std::abs(sun->direction.y);
         }
       })},
      {"ColorsClampedToOne", "DoublesWithTheLight",
       WithChangedImages([](const Scene&, Image& image) {
         for (float& value : image.pixels) value = std::min(value, 1.0F);
       })},
      {"OnlyTheFirstLight", "TwoEqualLightsAreOneOfTwiceTheColor",
       OfChangedScene([](Scene& scene, ParticleSet&) {
         scene.lights.resize(std::min<size_t>(scene.lights.size(), 1));
       })},
      {"AmbientLightSquared", "AmbientLightAddsUp", OfChangedScene([](Scene& scene, ParticleSet&) {
         scene.material.ambient *= scene.material.ambient;
       })},
      {"OpacityZeroTakenAsUnset", "IgnoresTransparentParticles",
       OfChangedScene([](Scene& scene, ParticleSet& set) {
         for (float& opacity : set.opacities) {
           if (opacity == 0.0F) opacity = scene.material.opacity;
         }
       })},
      {"DepthWithoutSign", "IgnoresWhatNobodySees",
       OfChangedScene([](Scene& scene, ParticleSet& set) {
         const glm::dmat4& view = scene.camera.view_from_world;
         const glm::dvec3 backward(view[0][2], view[1][2], view[2][2]);
         for (glm::vec3& position : set.positions) {
           const double z = (view * glm::dvec4(set.origin + glm::dvec3(position), 1.0)).z;
           if (z > 0.0) position -= glm::vec3(2.0 * z * backward);
         }
       })},
      {"CoverageOfTheLitOnly", "CoversTheSameUnderAnyLight",
       WithChangedImages([](const Scene& scene, Image& image) {
         if (!scene.lights.empty()) return;
         for (float& value : image.pixels) value *= 0.999F;
       })},
      {"DepthAsTransmittance", "TransmittanceIsAFraction",
       WithChangedImages([](const Scene&, Image& image) {
         for (float& value : image.pixels) value = -std::log(std::max(value, 1e-30F));
       })},
      {"LastBitByTurns", "SameRequestGivesSameBytes",
       WithChangedImages([](const Scene&, Image& image) {
         static bool odd = false;
         odd = !odd;
         if (odd) image.pixels[0] = std::nextafter(image.pixels[0], 2.0F);
       })},
  };
  return faults;
}

class FuzzCatches : public Fuzz, public testing::WithParamInterface<size_t> {};

TEST_P(FuzzCatches, TheFault) {
  const Fault& fault = Faults()[GetParam()];
  const auto property =
      std::find_if(Properties().begin(), Properties().end(),
                   [&](const Property& p) { return std::string(p.name) == fault.caught_by; });
  ASSERT_NE(property, Properties().end());
  const fuzz::Render faulty = [&](const FrameRequest& request) {
    return fault.render(request, Sound);
  };
  constexpr uint64_t kCases = 60;  // as many as the short form has
  for (uint64_t number = 0; number < kCases; ++number) {
    Dice dice(1, number);
    const Scene scene = DrawScene(dice);
    const double deviation = property->deviation(faulty, scene, dice);
    if (deviation <= BoundOf(*property, scene)) continue;
    std::cout << fault.name << ": caught by " << property->name << " in case " << number << ", "
              << deviation << " above " << BoundOf(*property, scene) << "\n";
    return;
  }
  FAIL() << fault.name << " gets past " << property->name;
}

INSTANTIATE_TEST_SUITE_P(Faults, FuzzCatches, testing::Range(size_t{0}, Faults().size()),
                         [](const auto& param) { return std::string(Faults()[param.param].name); });

TEST(FuzzFaults, ThereIsOneForEachProperty) {
  for (const Property& property : Properties()) {
    EXPECT_TRUE(std::any_of(Faults().begin(), Faults().end(), [&](const Fault& fault) {
      return std::string(fault.caught_by) == property.name;
    })) << property.name;
  }
}

}  // namespace
}  // namespace halflight::fuzz
