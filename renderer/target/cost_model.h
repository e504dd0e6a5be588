// How long rendering a frame and measuring its error will take, learnt from those that were: one
// for all frames of a device. Leaves out queues and encoding.
#pragma once

#include <mutex>
#include <vector>

#include "renderer/target/candidates.h"
#include "renderer/target/learned_sum.h"

namespace halflight {

// All functions: any thread.
class CostModel {
 public:
  // Starts from rates measured with llvmpipe (candidates.cpp).
  CostModel();

  // Milliseconds; positive.
  [[nodiscard]] double Predict(const SceneFeatures& features, const Settings& settings) const;
  // Of evaluating the model at so many covered pixels.
  [[nodiscard]] double PredictMeasurement(const SceneFeatures& features, double samples) const;
  // Typical |ln(measured / predicted)| of a technique's frames of late.
  [[nodiscard]] double spread(ShadowTechniqueKind kind) const;

  void Learn(const SceneFeatures& features, const Settings& settings, double milliseconds);
  void LearnMeasurement(const SceneFeatures& features, double samples, double milliseconds);

 private:
  mutable std::mutex mutex_;
  std::vector<LearnedSum> rendering_;  // by technique
  LearnedSum measuring_;
};

}  // namespace halflight
