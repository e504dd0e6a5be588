// The settings worth trying for a scene, technique by technique, and what is known of them before
// any was rendered. A technique more is a row more in candidates.cpp.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "renderer/image.h"
#include "renderer/scene.h"
#include "renderer/target/features.h"

namespace halflight {

// What a frame can be rendered with in place of Scene.shadow and Scene.sampling.
struct Settings {
  ShadowSettings shadow;
  Sampling sampling;

  bool operator==(const Settings&) const = default;
};

struct TargetLimits {
  double max_reference_work = 4e11;  // as ServerLimits
  int max_slices = 65536;
  int max_light_buffer_size = 4096;
  bool may_downsample = false;  // the request left the sampling unset
};

struct Candidates {
  std::vector<Settings> settings;
  // Why a technique has none of them, for people: one sentence without a full stop each.
  std::vector<std::string> refusals;
};

// Deterministic; keeps of scene.shadow what is no matter of speed against error (spacing, blur).
Candidates ListCandidates(const Scene& scene, const SceneFeatures& features,
                          std::span<const ImageRequest> images, const TargetLimits& limits);

// A technique's row.
struct TechniqueModel {
  ShadowTechniqueKind kind;
  const char* name;
  // Adds the technique's settings, or the reason why there are none.
  void (*list)(const Scene&, const SceneFeatures&, std::span<const ImageRequest>,
               const TargetLimits&, Candidates&);
  // What rendering comes to, and milliseconds for each, to start from.
  std::vector<double> (*cost_terms)(const SceneFeatures&, const Settings&);
  std::vector<double> cost_rates;
  // Squares of the parts of the relative RMSE, which add up.
  std::vector<double> (*error_terms)(const SceneFeatures&, const Settings&);
  size_t error_parts;
};

// The techniques that may be the best choice, in the order of ShadowTechniqueKind, which has those
// first.
std::span<const TechniqueModel> TechniqueModels();
const TechniqueModel& ModelOf(ShadowTechniqueKind kind);

// The reference's cost_terms where it evaluates only so many of the covered samples, to measure an
// error.
std::vector<double> MeasurementCostTerms(const SceneFeatures& features, double samples);

// "HALF_ANGLE, 256 slices, light buffer 512", with the downsampling where there is any.
std::string Describe(const Settings& settings);

}  // namespace halflight
