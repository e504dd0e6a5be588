#include "renderer/target/candidates.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace halflight {

namespace {

// Cost of half-angle slicing: traversals, particles sorted and projected, slices, texels of the
// light buffer copied and blurred between slices, fragments of the eye and of the light.
std::vector<double> HalfAngleCost(const SceneFeatures& features, const Settings& settings) {
  const double lights = std::max(1.0, static_cast<double>(features.lights.size()));
  const double texels = 1.0 * settings.shadow.light_buffer_size * settings.shadow.light_buffer_size;
  const double slices = features.lights.empty() ? 0.0 : settings.shadow.slices * lights;
  const double per_sample = 1.0 / (settings.sampling.downsample * settings.sampling.downsample);
  double deposited = 0.0;
  for (const LightFeatures& light : features.lights) deposited += light.quad_area * texels;
  return {lights,
          lights * features.particles,
          slices,
          slices * texels,
          features.scatters ? slices * texels : 0.0,
          lights * features.quad_samples * per_sample,
          deposited,
          lights * features.samples * per_sample};
}

// Of one light that casts shadows. The constants fit frames 24, 32 and 40 of the plume, thin and
// dense, 10 to 165 degrees between view and light, within a factor of 1.5.
struct LightError {
  double tilt;    // of the axis away from the light; no slicing helps
  double slices;  // their thickness, in optical depth
  double texels;  // their size against the particles'
};

LightError HalfAngleLightError(const LightFeatures& light, const ShadowSettings& shadow) {
  constexpr double kDensePlume = 15.0;  // the depth at which the constants hold as they stand
  const double sine = std::sqrt(0.5 * (1.0 - std::abs(light.cosine)));  // of the tilt
  const double thickness = std::sqrt(std::min(1.0, light.depth / kDensePlume));
  const double back = std::clamp(-light.cosine / 0.6, 0.0, 1.0);
  const double tilt = light.cosine > 0.0 ? 0.32 * sine : 0.08 * sine + 0.45 * sine * sine * sine;
  const double texels_per_radius = light.radius * shadow.light_buffer_size;
  return {std::min(1.0, tilt) * thickness,
          std::min(1.0, (1.0 - 0.55 * back) * 0.25 * std::pow(light.depth / shadow.slices, 0.58)),
          std::min(1.0, 0.45 * thickness / (texels_per_radius * texels_per_radius))};
}

std::vector<double> HalfAngleError(const SceneFeatures& features, const Settings& settings) {
  constexpr double kRounding = 1e-4;  // 32-bit float in the blend units
  LightError sum{};
  for (const LightFeatures& light : features.lights) {
    const LightError error = HalfAngleLightError(light, settings.shadow);
    sum.tilt += light.share * error.tilt;
    sum.slices += light.share * error.slices;
    sum.texels += light.share * error.texels;
  }
  const double radius = features.radius_samples / settings.sampling.downsample;
  const double downsampling =
      settings.sampling.downsample > 1 ? std::min(1.0, 0.16 * std::pow(radius, -1.2)) : 0.0;
  return {sum.tilt * sum.tilt + kRounding * kRounding, sum.slices * sum.slices,
          sum.texels * sum.texels, downsampling * downsampling};
}

// Of image and light buffer, by a cloud.
constexpr double kCovered = 0.4;

// What a sum along a ray still costs once what follows cannot be seen: the reference stops there.
double SeenShare(double depth) {
  constexpr double kOpaque = 24.0;  // -ln of its tolerance
  return depth > kOpaque ? kOpaque / depth : 1.0;
}

// Particles indexed, samples, particles met by them, and light rays' sums at those.
std::vector<double> ReferenceCostOf(const SceneFeatures& features, double samples) {
  constexpr double kDisk = 0.785;  // of a quad
  const double meets = kDisk * features.quad_samples / std::max(1.0, kCovered * features.samples);
  const double hits = samples * kCovered * meets * SeenShare(0.5 * meets * features.optical_depth);
  double summed = 0.0;
  for (const LightFeatures& light : features.lights) {
    summed += hits * kDisk * light.quad_area / kCovered * SeenShare(light.depth / kCovered);
  }
  const double indexed = features.particles * (1.0 + static_cast<double>(features.lights.size()));
  return {indexed, hits, summed, samples};
}

std::vector<double> ReferenceCost(const SceneFeatures& features, const Settings& /*settings*/) {
  return ReferenceCostOf(features, features.samples);
}

std::vector<double> ReferenceError(const SceneFeatures& /*features*/, const Settings& /*all*/) {
  constexpr double kRounding = 1e-6;  // of the image's 32-bit floats
  return {kRounding * kRounding};
}

// Sizes at which a particle's radius takes about two, four and eight texels: the error of coarser
// ones outweighs all others, and finer ones show no difference (docs/target-error.md).
std::vector<int> LightBufferSizes(const SceneFeatures& features, const TargetLimits& limits) {
  double radius = 1.0;
  for (const LightFeatures& light : features.lights) radius = std::min(radius, light.radius);
  std::vector<int> sizes;
  for (const double texels : {2.0, 4.0, 8.0}) {
    const double wanted = std::exp2(std::round(std::log2(texels / std::max(radius, 1e-6))));
    const int size = static_cast<int>(
        std::clamp(wanted, 64.0, static_cast<double>(std::max(64, limits.max_light_buffer_size))));
    sizes.push_back(std::min(size, limits.max_light_buffer_size));
  }
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  return sizes;
}

// Interpolated always: plain slicing takes as long, and is as right only where light comes from
// behind at high slice counts, where interpolation is within a percent of it.
void ListHalfAngle(const Scene& scene, const SceneFeatures& features,
                   std::span<const ImageRequest> /*images*/, const TargetLimits& limits,
                   Candidates& candidates) {
  for (const LightFeatures& light : features.lights) {
    if (!light.among_particles) continue;
    candidates.refusals.push_back(
        "HALF_ANGLE needs point lights that cast shadows outside the particles");
    return;
  }
  ShadowSettings shadow = scene.shadow;
  shadow.technique = ShadowTechniqueKind::kHalfAngle;
  shadow.interpolate = true;
  const int most_slices =
      static_cast<int>(std::clamp(features.particles, 1.0, static_cast<double>(limits.max_slices)));
  std::vector<int> slice_counts;
  for (const int slices : {16, 32, 64, 128, 256, 512, 1024, 2048}) {
    slice_counts.push_back(std::min(slices, most_slices));
    if (slices >= most_slices || features.lights.empty()) break;
  }
  std::vector<int> sizes = LightBufferSizes(features, limits);
  if (features.lights.empty()) sizes.resize(1);
  for (const int downsample : {1, 2, 4}) {
    if (downsample > 1 && (!limits.may_downsample || scene.sampling.supersample > 1)) break;
    Sampling sampling = scene.sampling;
    if (downsample > 1) sampling.downsample = downsample;
    for (const int slices : slice_counts) {
      for (const int size : sizes) {
        shadow.slices = slices;
        shadow.light_buffer_size = size;
        candidates.settings.push_back({shadow, sampling});
      }
    }
  }
}

void ListReference(const Scene& scene, const SceneFeatures& features,
                   std::span<const ImageRequest> images, const TargetLimits& limits,
                   Candidates& candidates) {
  const auto refuse = [&](std::string reason) { candidates.refusals.push_back(std::move(reason)); };
  if (features.scatters) {
    return refuse("the scene scatters light, which REFERENCE cannot");
  }
  if (scene.sampling.downsample > 1) {
    return refuse("the request downsamples, which REFERENCE cannot");
  }
  for (const ImageRequest& image : images) {
    if (image.kind == ImageKind::kLightBuffer || image.kind == ImageKind::kLightLayers) {
      return refuse("an output shows a light buffer, which REFERENCE has not");
    }
  }
  const double work = ReferenceWork(scene, features.pixels);
  if (work > limits.max_reference_work) {
    return refuse(absl::StrCat("REFERENCE would need ", work,
                               " samples times particles; the limit is ",
                               limits.max_reference_work));
  }
  ShadowSettings shadow = scene.shadow;
  shadow.technique = ShadowTechniqueKind::kReference;
  candidates.settings.push_back({shadow, scene.sampling});
}

// Slabs in which the sweep cuts a light's particles: where it scatters; else there are none.
double SlabsOf(const SceneFeatures& features, const ShadowSettings& shadow) {
  return features.scatters ? shadow.slices * static_cast<double>(features.lights.size()) : 0.0;
}

// Cost of the light sweep: particles sorted, projected and put into tiles, for the eye and for each
// light; texels met, their rows summed into the fit's terms, fits turned to the eye; fragments of
// the eye; samples; slabs, and texels blurred between them.
std::vector<double> LightSweepCost(const SceneFeatures& features, const Settings& settings) {
  const double lights = static_cast<double>(features.lights.size());
  const double size = settings.shadow.light_buffer_size;
  const int degree = settings.shadow.fit_degree;
  const double terms = 0.5 * (degree + 1) * (degree + 2);
  const double per_sample = 1.0 / (settings.sampling.downsample * settings.sampling.downsample);
  double deposited = 0.0;
  double rows = 0.0;
  for (const LightFeatures& light : features.lights) {
    deposited += light.quad_area * size * size;
    rows += features.particles * 2.0 * light.radius * size;
  }
  return {features.particles,
          lights * features.particles,
          lights * features.particles * terms,
          deposited,
          rows * terms,
          features.quad_samples * per_sample,
          lights * features.quad_samples * per_sample,
          features.samples * per_sample,
          SlabsOf(features, settings.shadow),
          SlabsOf(features, settings.shadow) * size * size};
}

// The constants fit the plume from opacity 0.02 to 0.9 within a factor of 1.5.
std::vector<double> LightSweepError(const SceneFeatures& features, const Settings& settings) {
  constexpr double kRounding = 1e-4;  // 32-bit float
  constexpr double kPlumeDepth =
      0.2;  // of a particle: where the degrees' errors hold as they stand
  constexpr std::array<double, kMaxFitDegree + 1> kByDegree = {0.2,   0.08,  0.033, 0.019,
                                                               0.012, 0.010, 0.008};
  double texels = 0.0;
  for (const LightFeatures& light : features.lights) {
    const double per_radius = std::max(0.5, light.radius * settings.shadow.light_buffer_size);
    texels += light.share * std::min(1.0, 0.11 * std::pow(per_radius, -1.7));
  }
  const double depth = std::pow(features.optical_depth / kPlumeDepth, 0.75);
  const double fit =
      features.lights.empty()
          ? 0.0
          : std::min(1.0, kByDegree[static_cast<size_t>(settings.shadow.fit_degree)] * depth);
  const double radius = features.radius_samples / settings.sampling.downsample;
  const double downsampling =
      settings.sampling.downsample > 1 ? std::min(1.0, 0.16 * std::pow(radius, -1.2)) : 0.0;
  return {fit * fit + kRounding * kRounding, texels * texels, downsampling * downsampling};
}

void ListLightSweep(const Scene& scene, const SceneFeatures& features,
                    std::span<const ImageRequest> /*images*/, const TargetLimits& limits,
                    Candidates& candidates) {
  const auto refuse = [&](std::string reason) { candidates.refusals.push_back(std::move(reason)); };
  for (const LightFeatures& light : features.lights) {
    if (light.among_particles) {
      return refuse("LIGHT_SWEEP needs point lights that cast shadows outside the particles");
    }
  }
  ShadowSettings shadow = scene.shadow;
  shadow.technique = ShadowTechniqueKind::kLightSweep;
  // Slabs are no matter of the error: what is measured of a frame whose light scatters is the same
  // frame without.
  shadow.slices = std::min(shadow.slices, limits.max_slices);
  std::vector<int> sizes = LightBufferSizes(features, limits);
  if (features.lights.empty()) sizes.resize(1);
  for (const int downsample : {1, 2, 4}) {
    if (downsample > 1 && (!limits.may_downsample || scene.sampling.supersample > 1)) break;
    Sampling sampling = scene.sampling;
    if (downsample > 1) sampling.downsample = downsample;
    for (const int degree : {1, 2, 3, 4, 6}) {
      for (const int size : sizes) {
        shadow.fit_degree = degree;
        shadow.light_buffer_size = size;
        candidates.settings.push_back({shadow, sampling});
      }
      if (features.lights.empty()) break;
    }
  }
}

// Rates are milliseconds on two cores with the llvmpipe of Mesa 22.3.6, fitted to 470 frames of the
// plume, 160 x 120 to 1280 x 1024; half of them lie within a factor of 1.2, nine in ten of 1.6.
// Those of the light sweep, with AVX2, from seven frames of plume 40 at 640 x 512. The particle
// shadow map has no row: at the same degree it takes longer than the sweep, and is further from the
// model.
const std::vector<TechniqueModel>& Models() {
  static const std::vector<TechniqueModel> models = {
      {ShadowTechniqueKind::kHalfAngle,
       "HALF_ANGLE",
       ListHalfAngle,
       HalfAngleCost,
       {10.0, 1.4e-3, 0.07, 1.7e-8, 1e-7, 3e-5, 2.2e-6, 5e-6},
       HalfAngleError,
       4},
      {ShadowTechniqueKind::kReference,
       "REFERENCE",
       ListReference,
       ReferenceCost,
       {5e-4, 3e-5, 2.9e-7, 4e-4},
       ReferenceError,
       1},
      {ShadowTechniqueKind::kLightSweep,
       "LIGHT_SWEEP",
       ListLightSweep,
       LightSweepCost,
       {5e-5, 5e-5, 4.5e-6, 2.3e-7, 2.6e-6, 4e-7, 4.5e-7, 3e-6, 0.05, 4e-6},
       LightSweepError,
       3},
  };
  return models;
}

}  // namespace

Candidates ListCandidates(const Scene& scene, const SceneFeatures& features,
                          std::span<const ImageRequest> images, const TargetLimits& limits) {
  Candidates candidates;
  for (const TechniqueModel& model : TechniqueModels()) {
    model.list(scene, features, images, limits, candidates);
  }
  return candidates;
}

std::span<const TechniqueModel> TechniqueModels() { return Models(); }

const TechniqueModel& ModelOf(ShadowTechniqueKind kind) {
  return Models()[static_cast<size_t>(kind)];
}

std::vector<double> MeasurementCostTerms(const SceneFeatures& features, double samples) {
  // Covered samples meet particles, so that they cost more than samples of the whole window.
  return ReferenceCostOf(features, std::min(samples / kCovered, features.samples));
}

std::string Describe(const Settings& settings) {
  std::string text = ModelOf(settings.shadow.technique).name;
  if (settings.shadow.technique == ShadowTechniqueKind::kLightSweep) {
    absl::StrAppend(&text, ", degree ", settings.shadow.fit_degree, ", light buffer ",
                    settings.shadow.light_buffer_size);
  } else if (settings.shadow.technique == ShadowTechniqueKind::kHalfAngle) {
    absl::StrAppend(&text, ", ", settings.shadow.slices, " slices, light buffer ",
                    settings.shadow.light_buffer_size);
  }
  if (settings.sampling.downsample > 1) {
    absl::StrAppend(&text, ", downsample ", settings.sampling.downsample);
  }
  return text;
}

}  // namespace halflight
