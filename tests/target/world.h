// Made-up worlds, in which every setting has a time and an error of its own: what a search is
// tried on without rendering. Drawn from a seed, so that a failure can be had again.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "renderer/target/search.h"
#include "tests/renderer/test_scene.h"

namespace halflight::test {

// Numbers that are the same with every library.
class Draw {
 public:
  explicit Draw(uint32_t seed) : random_(seed) {}
  double Uniform(double low, double high) { return low + (high - low) * (random_() * 0x1p-32); }
  double LogUniform(double low, double high) {
    return std::exp(Uniform(std::log(low), std::log(high)));
  }
  // A sum of twelve uniform numbers: variance 1, and no further out than 6.
  double Normal() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += Uniform(0.0, 1.0);
    return sum;
  }

 private:
  std::mt19937 random_;
};

// A lit ball seen from anywhere, thin to dense, of few pixels (where the reference is fastest) to
// many.
inline Scene RandomScene(uint32_t seed) {
  Draw draw(seed);
  Scene scene = BallScene(static_cast<size_t>(draw.LogUniform(500, 20000)),
                          static_cast<int>(draw.LogUniform(64, 4096)));
  scene.material.opacity = static_cast<float>(draw.LogUniform(0.01, 0.5));
  scene.lights = {Sun({draw.Uniform(-1, 1), draw.Uniform(-1, 1), draw.Uniform(-1, 1)})};
  return scene;
}

class World {
 public:
  // `wrongness`: standard deviation, in the logarithm, of this world's parts of times and errors
  // from those that the models start from.
  World(const Scene& scene, uint32_t seed, double wrongness = 0.5)
      : features_(FeaturesOf(scene)), seed_(seed) {
    Draw draw(seed ^ 0x5eedU);
    for (const TechniqueModel& model : TechniqueModels()) {
      const double speed = std::exp(wrongness * draw.Normal());
      std::vector<double> rates;
      for (const double rate : model.cost_rates) {
        rates.push_back(rate * speed * std::exp(0.5 * wrongness * draw.Normal()));
      }
      rates_.push_back(rates);
      std::vector<double> parts(model.error_parts);
      for (double& part : parts) part = std::exp(2.0 * wrongness * draw.Normal());
      parts_.push_back(parts);
    }
  }

  [[nodiscard]] double Milliseconds(const Settings& settings) const {
    const auto kind = static_cast<size_t>(settings.shadow.technique);
    return Sum(ModelOf(settings.shadow.technique).cost_terms(features_, settings), rates_[kind]) *
           Quirk(settings, 1);
  }
  // The true relative RMSE.
  [[nodiscard]] double Error(const Settings& settings) const {
    const auto kind = static_cast<size_t>(settings.shadow.technique);
    return std::sqrt(Sum(ModelOf(settings.shadow.technique).error_terms(features_, settings),
                         parts_[kind])) *
           Quirk(settings, 2);
  }

  // What a step shows, its interval as random as a sample makes it.
  [[nodiscard]] TargetObservation Observe(const TargetStep& step) const {
    TargetObservation observation;
    observation.milliseconds = Milliseconds(step.settings);
    if (step.samples == 0) return observation;
    Draw draw(seed_ + 977 * static_cast<uint32_t>(step.samples) + Hash(step.settings));
    const double deviation = 0.04 * std::sqrt(1024.0 / step.samples);
    const double value = Error(step.settings) * std::exp(deviation * draw.Normal());
    observation.relative_rmse = EstimatedFigure{value, value * std::exp(-1.96 * deviation),
                                                value * std::exp(1.96 * deviation)};
    observation.measurement_ms = 5.0 + 0.01 * step.samples;
    return observation;
  }

 private:
  static double Sum(const std::vector<double>& terms, const std::vector<double>& rates) {
    double sum = 0.0;
    for (size_t i = 0; i < terms.size(); ++i) sum += terms[i] * rates[i];
    return sum;
  }
  static uint32_t Hash(const Settings& settings) {
    return static_cast<uint32_t>(settings.shadow.slices * 31 +
                                 settings.shadow.light_buffer_size * 7 +
                                 settings.sampling.downsample * 3) +
           static_cast<uint32_t>(settings.shadow.technique);
  }
  // What no model foresees of these settings.
  [[nodiscard]] double Quirk(const Settings& settings, uint32_t salt) const {
    return std::exp(0.05 * Draw(seed_ * 7919 + Hash(settings) * 4 + salt).Normal());
  }

  SceneFeatures features_;
  uint32_t seed_;
  std::vector<std::vector<double>> rates_;
  std::vector<std::vector<double>> parts_;
};

// Runs a search to its end, and keeps frames as it says.
inline TargetOutcome Run(TargetSearch& search, const World& world) {
  std::vector<bool> kept;
  while (const std::optional<TargetStep> step = search.Next()) {
    if (step->action == TargetAction::kRender) {
      kept.push_back(true);
    } else {
      EXPECT_TRUE(kept.back());
    }
    search.Observe(world.Observe(*step));
    for (size_t i = 0; i < kept.size(); ++i) kept[i] = kept[i] && search.Needs(i);
  }
  const TargetOutcome outcome = search.outcome();
  EXPECT_TRUE(outcome.returned && kept.at(*outcome.returned));
  EXPECT_LE(std::count(kept.begin(), kept.end(), true), 2);
  return outcome;
}

}  // namespace halflight::test
