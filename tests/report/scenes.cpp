#include "tests/report/scenes.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/measure/plume_scene.h"
#include "tests/measure/replicate.h"

namespace halflight::report {
namespace {

struct NamedLight {
  const char* name;
  glm::dvec3 direction;
  bool perpendicular = false;  // to the view: what is along it is taken away
};

constexpr std::array<NamedLight, 4> kLights = {{
    {"front", {-0.2, -0.3, -1.0}},
    {"side", measure::kSideLight},
    {"90 degrees", {1.0, -0.6, 0.0}, true},
    {"back", {0.3, -0.4, 1.0}},
}};

constexpr std::array<std::pair<const char*, float>, 2> kOpacities = {{
    {"dense", measure::kPlumeOpacity},
    {"thin", 0.02F},
}};

constexpr std::array<size_t, 4> kCounts = {8'192, 65'536, 262'144, 1'048'576};
constexpr size_t kBaselineCount = 65'536;
// The short form thins the plume out.
constexpr std::array<size_t, 2> kShortCounts = {1'024, 4'096};
constexpr size_t kShortBaselineCount = 4'096;

glm::dvec3 Forward() {
  return -glm::normalize(glm::dvec3(glm::row(measure::PlumeCamera(1, 1).view_from_world, 2)));
}

glm::dvec3 DirectionOf(const std::string& name) {
  for (const NamedLight& light : kLights) {
    if (light.name != name) continue;
    const glm::dvec3 along = Forward() * glm::dot(Forward(), light.direction);
    return glm::normalize(light.perpendicular ? light.direction - along : light.direction);
  }
  return Forward();
}

Scene LitPlume(const measure::Replica& replica, const std::string& light,
               const SceneOptions& options) {
  const int size = options.short_form ? 96 : 480;
  return measure::PlumeScene(replica, DirectionOf(light), size, size);
}

void AddMatrix(const SceneOptions& options, const std::string& frame, const ParticleSet& plume,
               std::vector<ReportScene>& scenes) {
  const size_t count = options.short_form ? kShortBaselineCount : plume.size();
  for (const auto& [opacity_name, opacity] : kOpacities) {
    const measure::Replica replica =
        measure::Replicate(plume, count, opacity, measure::kPlumeJitter);
    for (const NamedLight& light : kLights) {
      if (options.short_form && light.perpendicular) continue;
      scenes.push_back({.name = absl::StrCat("plume", frame.substr(2), "-", opacity_name, "-",
                                             light.perpendicular ? "90" : light.name),
                        .plume = frame,
                        .light = light.name,
                        .opacity = opacity_name,
                        .part = Part::kMatrix,
                        .scene = LitPlume(replica, light.name, options)});
    }
  }
}

void AddScaling(const SceneOptions& options, const std::string& frame, const ParticleSet& plume,
                std::vector<ReportScene>& scenes) {
  const char* const light = "side";
  const auto& [opacity_name, opacity] = kOpacities[0];
  std::vector<size_t> counts(kCounts.begin(), kCounts.end());
  if (options.short_form) counts.assign(kShortCounts.begin(), kShortCounts.end());
  const size_t baseline = options.short_form ? kShortBaselineCount : kBaselineCount;
  for (const size_t count : counts) {
    const measure::Replica replica =
        measure::Replicate(plume, count, opacity, measure::kPlumeJitter);
    scenes.push_back({.name = absl::StrCat("particles-", count),
                      .plume = frame,
                      .light = light,
                      .opacity = opacity_name,
                      .part = Part::kScaling,
                      .scaling_baseline = count == baseline,
                      .scene = LitPlume(replica, light, options)});
  }
}

}  // namespace

double DegreesFromView(const std::string& light) {
  return std::acos(glm::dot(Forward(), DirectionOf(light))) * 180.0 / std::numbers::pi;
}

std::vector<std::string> LightNames() {
  std::vector<std::string> names;
  for (const NamedLight& light : kLights) names.emplace_back(light.name);
  return names;
}

std::string LightTitle(const std::string& light) {
  return absl::StrFormat("%s (%.0f\u00b0)", light == "90 degrees" ? "side" : light,
                         DegreesFromView(light));
}

std::vector<std::pair<std::string, float>> Opacities() {
  return {kOpacities.begin(), kOpacities.end()};
}

absl::StatusOr<std::vector<ReportScene>> LoadScenes(const SceneOptions& options) {
  const auto early = measure::LoadPlumeFrame(options.data_folder, "0024");
  if (!early.ok()) return early.status();
  const auto late = measure::LoadPlumeFrame(options.data_folder, "0040");
  if (!late.ok()) return late.status();
  std::vector<ReportScene> scenes;
  if (!options.short_form) AddMatrix(options, "0024", **early, scenes);
  AddMatrix(options, "0040", **late, scenes);
  AddScaling(options, "0040", **late, scenes);
  return scenes;
}

}  // namespace halflight::report
