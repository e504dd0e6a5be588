#include "renderer/target/cost_model.h"

#include <algorithm>

namespace halflight {

namespace {

constexpr double kLeastMilliseconds = 0.01;  // an empty scene's

// The first rates hold for one kind of machine: a GPU's are a hundredth of them.
constexpr LearnedSumOptions kOptions{.prior_observations = 1.0, .least_gain = 0.15, .spread = 0.5};

}  // namespace

CostModel::CostModel() : measuring_(ModelOf(ShadowTechniqueKind::kReference).cost_rates, kOptions) {
  for (const TechniqueModel& model : TechniqueModels()) {
    rendering_.emplace_back(model.cost_rates, kOptions);
  }
}

double CostModel::Predict(const SceneFeatures& features, const Settings& settings) const {
  const std::vector<double> terms =
      ModelOf(settings.shadow.technique).cost_terms(features, settings);
  const std::lock_guard lock(mutex_);
  const LearnedSum& sum = rendering_[static_cast<size_t>(settings.shadow.technique)];
  return std::max(kLeastMilliseconds, sum.Predict(terms));
}

double CostModel::PredictMeasurement(const SceneFeatures& features, double samples) const {
  const std::vector<double> terms = MeasurementCostTerms(features, samples);
  const std::lock_guard lock(mutex_);
  return std::max(kLeastMilliseconds, measuring_.Predict(terms));
}

double CostModel::spread(ShadowTechniqueKind kind) const {
  const std::lock_guard lock(mutex_);
  return rendering_[static_cast<size_t>(kind)].spread();
}

void CostModel::Learn(const SceneFeatures& features, const Settings& settings,
                      double milliseconds) {
  const std::vector<double> terms =
      ModelOf(settings.shadow.technique).cost_terms(features, settings);
  const std::lock_guard lock(mutex_);
  rendering_[static_cast<size_t>(settings.shadow.technique)].Learn(terms, milliseconds);
}

void CostModel::LearnMeasurement(const SceneFeatures& features, double samples,
                                 double milliseconds) {
  const std::vector<double> terms = MeasurementCostTerms(features, samples);
  const std::lock_guard lock(mutex_);
  measuring_.Learn(terms, milliseconds);
}

}  // namespace halflight
