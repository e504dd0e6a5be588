#include "tests/hard_cases/properties.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include "tests/hard_cases/hard_case.h"
#include "tests/hard_cases/same_picture.h"
#include "tests/oracle/oracle.h"
#include "tests/reference/brute_force.h"

namespace halflight::fuzz {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Image BeautyOf(const Render& render, const Scene& scene) {
  FrameResult frame = render({scene, {{ImageKind::kBeauty}}});
  return frame.images.empty() ? Image{} : std::move(frame.images[0]);
}

// Root of the mean square of what `difference` says of each value, relative to the brightest value
// where that is above 1: coverage is not.
template <typename Difference>
double Deviation(const Image& image, const Difference& difference) {
  if (image.pixels.empty()) return kInfinity;
  double squares = 0.0;
  double brightest = 1.0;
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    squares += std::pow(difference(i), 2);
    brightest = std::max(brightest, std::abs(static_cast<double>(image.pixels[i])));
  }
  const double rms = std::sqrt(squares / static_cast<double>(image.pixels.size())) / brightest;
  return std::isnan(rms) ? kInfinity : rms;
}

double Difference(const Image& a, const Image& b) {
  if (a.pixels.size() != b.pixels.size()) return kInfinity;
  return Deviation(a, [&](size_t i) { return static_cast<double>(a.pixels[i]) - b.pixels[i]; });
}

// How far image `sum` - `base` is from the sum of `parts` - `base`.
double DifferenceFromSum(const Image& sum, const std::vector<Image>& parts, const Image& base) {
  return Deviation(sum, [&](size_t i) {
    double expected = base.pixels[i];
    for (const Image& part : parts) {
      expected += static_cast<double>(part.pixels.at(i)) - base.pixels[i];
    }
    return sum.pixels[i] - expected;
  });
}

// Particles one a slice, however many there are: then a further one changes no other's slice.
Scene OneParticleASlice(const Scene& scene) {
  Scene sliced = test::WithOwnAttributes(scene);
  sliced.shadow.slices = 65536;
  sliced.shadow.spacing = SliceSpacing::kEqualCount;
  return sliced;
}

template <typename T>
void Reorder(const std::vector<size_t>& order, std::vector<T>& values) {
  if (values.empty()) return;
  std::vector<T> reordered;
  for (const size_t i : order) reordered.push_back(values[i]);
  values = std::move(reordered);
}

double OfModel(const Render& render, Scene scene) {
  scene.sampling.downsample = 1;  // the model samples every pixel
  scene.shadow.light_buffer_size = 1024;
  const Image image = BeautyOf(render, scene);
  if (scene.shadow.technique == ShadowTechniqueKind::kHalfAngle) {
    const oracle::OracleImage exact = oracle::RenderHalfAngle(scene);
    return Deviation(image, [&](size_t i) {
      return image.pixels[i] - exact.rgba[i / 4][static_cast<glm::length_t>(i % 4)];
    });
  }
  // The reference: at every seventh pixel, by loops that share nothing with it.
  const Scene here = test::Moved(test::WithOwnAttributes(scene), -scene.particles->origin);
  double largest = image.pixels.empty() ? kInfinity : 0.0;
  for (size_t p = 3; p < image.pixels.size() / 4; p += 7) {
    const int width = scene.camera.window.width;
    const glm::dvec4 exact = reference::RenderByBruteForce(
                                 here, {static_cast<int>(p) % width, static_cast<int>(p) / width})
                                 .rgba;
    for (int c = 0; c < 4; ++c) {
      const double value = image.pixels[4 * p + static_cast<size_t>(c)];
      largest = std::max(largest, std::abs(value - exact[c]) / std::max(1.0, std::abs(exact[c])));
    }
  }
  return largest;
}

double EqualsModel(const Render& render, const Scene& scene, Dice& /*dice*/) {
  return OfModel(render, scene);
}

// A third of the particles once more, at the same places in other colours.
double BreaksTiesByIndex(const Render& render, const Scene& scene, Dice& dice) {
  Scene tied = test::WithOwnAttributes(scene);
  ParticleSet& set = test::EditParticles(tied);
  const size_t count = (set.size() + 2) / 3;
  for (size_t i = 0; i < count; ++i) {
    set.positions.push_back(set.positions[i]);
    set.radii.push_back(set.radii[i]);
    set.opacities.push_back(static_cast<float>(dice.Between(0.3, 0.8)));
    set.colors.emplace_back(dice.Vector(0.0, 1.0));
    set.emissions.emplace_back(dice.Vector(0.0, 0.5));
    set.velocities.push_back(set.velocities[i]);
  }
  return OfModel(render, tied);
}

double IgnoresOrderOfParticles(const Render& render, const Scene& scene, Dice& dice) {
  std::vector<size_t> order(scene.particles->size());
  std::iota(order.begin(), order.end(), size_t{0});
  for (size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[static_cast<size_t>(dice.Integer(0, static_cast<int>(i) - 1))]);
  }
  Scene shuffled = scene;
  ParticleSet& set = test::EditParticles(shuffled);
  Reorder(order, set.positions);
  Reorder(order, set.radii);
  Reorder(order, set.opacities);
  Reorder(order, set.colors);
  Reorder(order, set.velocities);
  Reorder(order, set.emissions);
  return Difference(BeautyOf(render, shuffled), BeautyOf(render, scene));
}

double JoinsWindows(const Render& render, const Scene& drawn, Dice& dice) {
  Scene scene = drawn;
  scene.sampling.downsample = 1;  // its samples are those of the window, not of the image
  const PixelRect& window = scene.camera.window;
  const int split = dice.Integer(1, window.width - 1);
  Scene left = scene;
  left.camera.window.width = split;
  Scene right = scene;
  right.camera.window.x += split;
  right.camera.window.width -= split;
  const Image whole = BeautyOf(render, scene);
  const Image parts[] = {BeautyOf(render, left), BeautyOf(render, right)};
  return Deviation(whole, [&](size_t i) {
    const size_t row = i / (4 * static_cast<size_t>(window.width));
    const int column = static_cast<int>(i / 4) % window.width;
    const Image& part = parts[column < split ? 0 : 1];
    const int part_column = column < split ? column : column - split;
    return static_cast<double>(whole.pixels[i]) -
           part.pixels.at(
               4 * (row * static_cast<size_t>(part.width) + static_cast<size_t>(part_column)) +
               i % 4);
  });
}

// How large the scene is: the distance from the eye to the set's origin, and a radius.
double SizeOf(const Scene& scene) {
  const glm::dvec3 origin(scene.camera.view_from_world * glm::dvec4(scene.particles->origin, 1.0));
  const float radius =
      scene.particles->radii.empty() ? scene.material.radius : scene.particles->radii[0];
  return glm::length(origin) + static_cast<double>(radius);
}

double MovesWithTheWorld(const Render& render, const Scene& scene, Dice& dice) {
  const double distance = SizeOf(scene) * std::pow(10.0, dice.Between(0.0, 6.0));
  const Scene moved = test::Moved(scene, distance * dice.Direction());
  return Difference(BeautyOf(render, moved), BeautyOf(render, scene));
}

double ScalesWithTheWorld(const Render& render, const Scene& scene, Dice& dice) {
  const double size = std::pow(10.0, dice.Between(-6.0, 6.0));
  const Scene scaled = test::Scaled(scene, size / SizeOf(scene));
  return Difference(BeautyOf(render, scaled), BeautyOf(render, scene));
}

double TurnsWithTheWorld(const Render& render, const Scene& scene, Dice& dice) {
  glm::dmat3 rotation(glm::rotate(glm::dmat4(1.0), dice.Between(0.3, 3.0), dice.Direction()));
  // Half-angle slicing sees a point light from the middle of the particles' bounding box, which
  // stays where it is when axes turn into axes.
  const bool points = std::any_of(scene.lights.begin(), scene.lights.end(), [](const Light& light) {
    return std::holds_alternative<PointLight>(light.kind);
  });
  if (points) rotation = glm::dmat3({0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, {1.0, 0.0, 0.0});
  return Difference(BeautyOf(render, test::Turned(scene, rotation)), BeautyOf(render, scene));
}

// A scene with a light to look at, and which.
size_t WithALight(Scene& scene, Dice& dice) {
  if (scene.lights.empty()) scene.lights.push_back({DirectionalLight{dice.Direction()}});
  const size_t which =
      static_cast<size_t>(dice.Integer(0, static_cast<int>(scene.lights.size()) - 1));
  if (scene.lights[which].color == glm::vec3(0.0F)) scene.lights[which].color = glm::vec3(1.0F);
  return which;
}

double DoublesWithTheLight(const Render& render, const Scene& scene, Dice& dice) {
  Scene lit = scene;
  Light& light = lit.lights[WithALight(lit, dice)];
  const Image once = BeautyOf(render, lit);
  const glm::vec3 color = light.color;
  light.color = 2.0F * color;
  const Image twice = BeautyOf(render, lit);
  light.color = glm::vec3(0.0F);
  return DifferenceFromSum(twice, {once, once}, BeautyOf(render, lit));
}

double TwoEqualLightsAreOneOfTwiceTheColor(const Render& render, const Scene& scene, Dice& dice) {
  Scene one = scene;
  const size_t which = WithALight(one, dice);
  Scene two = one;
  two.lights.push_back(two.lights[which]);
  one.lights[which].color *= 2.0F;
  return Difference(BeautyOf(render, two), BeautyOf(render, one));
}

double AmbientLightAddsUp(const Render& render, const Scene& scene, Dice& dice) {
  const glm::vec3 a(dice.Vector(0.1, 1.0));
  const glm::vec3 b(dice.Vector(0.1, 1.0));
  const auto with = [&](const glm::vec3& ambient) {
    Scene lit = scene;
    lit.material.ambient = ambient;
    return BeautyOf(render, lit);
  };
  return DifferenceFromSum(with(a + b), {with(a), with(b)}, with(glm::vec3(0.0F)));
}

double IgnoresTransparentParticles(const Render& render, const Scene& scene, Dice& dice) {
  const Scene without = OneParticleASlice(scene);
  Scene with = without;
  ParticleSet& set = test::EditParticles(with);
  // Between two others, so that the light buffer is fitted as before.
  const int last = static_cast<int>(set.size()) - 1;
  const auto i = static_cast<size_t>(dice.Integer(0, last));
  const auto j = static_cast<size_t>(dice.Integer(0, last));
  set.positions.push_back(0.5F * (set.positions[i] + set.positions[j]));
  set.velocities.push_back(0.5F * (set.velocities[i] + set.velocities[j]));
  set.radii.push_back(std::min(set.radii[i], set.radii[j]));
  set.opacities.push_back(0.0F);
  set.colors.emplace_back(10.0F);
  set.emissions.emplace_back(10.0F);
  return Difference(BeautyOf(render, with), BeautyOf(render, without));
}

// Whether a particle at p (from the set's origin) might shade another of the scene.
bool MayShade(const Scene& scene, const glm::dvec3& p, double radius) {
  const ParticleSet& set = *scene.particles;
  for (const Light& light : scene.lights) {
    const auto* point = std::get_if<PointLight>(&light.kind);
    const glm::dvec3 from = point != nullptr ? point->position - set.origin : glm::dvec3(0.0);
    for (size_t i = 0; i < set.size(); ++i) {
      const glm::dvec3 center =
          glm::dvec3(set.positions[i]) + scene.time_offset_s * glm::dvec3(set.velocities[i]) - from;
      const double reach = 1.5 * (radius + static_cast<double>(set.radii[i]));
      if (point == nullptr) {
        const glm::dvec3& l = std::get<DirectionalLight>(light.kind).direction;
        if (glm::length(glm::cross(center - p, l)) < reach) return true;
      } else {
        const double distance = glm::length(center);
        const double sine =
            glm::length(glm::cross(center, p - from)) / (distance * glm::length(p - from));
        if (glm::dot(center, p - from) > 0.0 && sine * distance < reach) return true;
      }
    }
  }
  return false;
}

double IgnoresWhatNobodySees(const Render& render, const Scene& scene, Dice& dice) {
  Scene without = OneParticleASlice(scene);
  // Lights of the technique that stand outside the particles must not be among the new ones.
  std::erase_if(without.lights,
                [](const Light& light) { return std::holds_alternative<PointLight>(light.kind); });
  ParticleSet& set = test::EditParticles(without);
  const double radius = set.radii[0];
  const glm::dvec3 forward = -glm::dvec3(glm::row(scene.camera.view_from_world, 2));
  const glm::dvec3 eye = -glm::transpose(glm::dmat3(scene.camera.view_from_world)) *
                             glm::dvec3(scene.camera.view_from_world[3]) -
                         set.origin;
  glm::dvec3 hidden;
  int tries = 0;
  do {
    glm::dvec3 away = dice.Direction();
    if (glm::dot(away, forward) > -0.2) away = -away;
    hidden = eye + away * SizeOf(scene) * dice.Between(2.0, 6.0);
  } while (++tries < 100 &&
           (glm::dot(hidden - eye, forward) > -2.0 * radius || MayShade(without, hidden, radius)));
  if (tries == 100) return 0.0;
  // Transparent there in both: the light buffer and the axes are fitted to the same bounds.
  set.positions.emplace_back(hidden);
  set.velocities.emplace_back(0.0F);
  set.radii.push_back(static_cast<float>(radius));
  set.opacities.push_back(0.0F);
  set.colors.emplace_back(1.0F);
  set.emissions.emplace_back(5.0F);
  Scene with = without;
  test::EditParticles(with).opacities.back() = 0.9F;
  return Difference(BeautyOf(render, with), BeautyOf(render, without));
}

double CoversTheSameUnderAnyLight(const Render& render, const Scene& scene, Dice& dice) {
  Scene other = scene;
  other.lights = {{DirectionalLight{dice.Direction()}}};
  Scene dark = scene;
  dark.lights.clear();
  const Image lit = BeautyOf(render, scene);
  const Image lit_otherwise = BeautyOf(render, other);
  const Image unlit = BeautyOf(render, dark);
  if (lit.pixels.size() != unlit.pixels.size()) return kInfinity;
  double largest = 0.0;
  for (size_t i = 3; i < lit.pixels.size(); i += 4) {
    largest = std::max({largest, std::abs(static_cast<double>(lit.pixels[i]) - unlit.pixels[i]),
                        std::abs(static_cast<double>(lit_otherwise.pixels[i]) - unlit.pixels[i])});
  }
  return largest;
}

double TransmittanceIsAFraction(const Render& render, const Scene& scene, Dice& dice) {
  Scene lit = scene;
  const size_t which = WithALight(lit, dice);
  if (!lit.lights[which].casts_shadows()) lit.lights[which].shadow_density = glm::vec3(1.0F);
  if (lit.shadow.technique == ShadowTechniqueKind::kHalfAngle) {
    lit.lights[which].kind = DirectionalLight{dice.Direction()};
  }
  const FrameResult frame =
      render({lit, {{ImageKind::kLightTransmittance, static_cast<int>(which)}}});
  if (frame.images.empty()) return kInfinity;
  double outside = 0.0;
  for (const float value : frame.images[0].pixels) {
    if (std::isnan(value)) return kInfinity;
    outside = std::max({outside, -static_cast<double>(value), static_cast<double>(value) - 1.0});
  }
  return outside;
}

double SameRequestGivesSameBytes(const Render& render, const Scene& scene, Dice& /*dice*/) {
  const Image once = BeautyOf(render, scene);
  const Image again = BeautyOf(render, scene);
  if (once.pixels.empty() || once.pixels.size() != again.pixels.size()) return kInfinity;
  return test::DifferentFloats(once, again);
}

}  // namespace

double BoundOf(const Property& property, const Scene& scene) {
  const bool shadows = std::any_of(scene.lights.begin(), scene.lights.end(),
                                   [](const Light& light) { return light.casts_shadows(); });
  if (!shadows || scene.shadow.technique == ShadowTechniqueKind::kReference) return property.bound;
  // The rim of a ball is steep: texels show there more than elsewhere.
  const double steep = scene.material.profile == Profile::kBall ? 8.0 : 1.0;
  return std::max(property.bound, steep * property.bound_with_light_buffer);
}

const std::vector<Property>& Properties() {
  static const std::vector<Property> properties = {
      {"EqualsModel", 3e-6, 5e-4, EqualsModel},
      {"BreaksTiesByIndex", 3e-6, 5e-4, BreaksTiesByIndex},
      {"IgnoresOrderOfParticles", 0.0, 0.0, IgnoresOrderOfParticles},
      {"JoinsWindows", 3e-6, 0.0, JoinsWindows},
      {"MovesWithTheWorld", 3e-6, 0.0, MovesWithTheWorld},
      {"ScalesWithTheWorld", 1e-5, 0.0, ScalesWithTheWorld},
      {"TurnsWithTheWorld", 3e-6, 4e-3, TurnsWithTheWorld},
      {"DoublesWithTheLight", 1e-6, 0.0, DoublesWithTheLight},
      {"TwoEqualLightsAreOneOfTwiceTheColor", 1e-6, 0.0, TwoEqualLightsAreOneOfTwiceTheColor},
      {"AmbientLightAddsUp", 1e-6, 0.0, AmbientLightAddsUp},
      {"IgnoresTransparentParticles", 0.0, 0.0, IgnoresTransparentParticles},
      {"IgnoresWhatNobodySees", 0.0, 0.0, IgnoresWhatNobodySees},
      {"CoversTheSameUnderAnyLight", 1e-6, 0.0, CoversTheSameUnderAnyLight},
      {"TransmittanceIsAFraction", 1e-6, 0.0, TransmittanceIsAFraction},
      {"SameRequestGivesSameBytes", 0.0, 0.0, SameRequestGivesSameBytes},
  };
  return properties;
}

}  // namespace halflight::fuzz
