// How far a frame is from the image model, in parts of the model's mean brightness.
// Leaves out perceptual measures.
#pragma once

#include "absl/status/statusor.h"
#include "renderer/image.h"
#include "renderer/reference/evaluator.h"
#include "renderer/scene.h"
#include "tests/oracle/oracle.h"

namespace halflight::measure {

// Over R, G and B, premultiplied and linear, of the covered pixels (coverage > 0.01), all divided
// by the reference's mean over the same pixels.
struct FrameError {
  double rmse = 0.0;
  double rmse_low = 0.0;  // 95 % interval; rmse itself where every pixel was compared
  double rmse_high = 0.0;
  double bias = 0.0;  // mean of frame minus reference
  double p999 = 0.0;  // of the absolute differences, as is the next
  double max = 0.0;
};

// The reference at all pixels that it covers, and its mean over them.
struct CoveredReference {
  oracle::OracleImage pixels;
  double mean = 0.0;
};
CoveredReference EvaluateCovered(const Scene& scene);

FrameError CompareAll(const Image& beauty, const CoveredReference& reference);

// From 1024 random pixels: percentile and maximum are of these alone. For scenes whose reference
// takes minutes at every pixel. Errors as EstimateError.
absl::StatusOr<FrameError> CompareSample(const Image& beauty,
                                         const reference::Evaluator& evaluator);

}  // namespace halflight::measure
