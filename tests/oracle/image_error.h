// How far an image is from the oracle's, in the measures this project uses.
// Perceptual measures are left out.
#pragma once

#include <span>
#include <string>

#include "renderer/image.h"
#include "tests/oracle/oracle.h"

namespace halflight::oracle {

struct ImageError {
  double rmse = 0.0;
  double bias = 0.0;           // mean of image minus reference
  double max = 0.0;            // of the absolute difference
  double p999 = 0.0;           // its 99.9th percentile
  double relative_rmse = 0.0;  // over pixels with reference coverage > 0.01, to the mean over them
  size_t pixels = 0;           // compared

  [[nodiscard]] std::string ToString() const;
};

// Premultiplied linear R, G and B of a beauty image, over the pixels that the oracle evaluated.
// `image` has the size of the oracle's window.
ImageError CompareColor(const Image& image, const OracleImage& reference);

// The channel A of a beauty or coverage image.
ImageError CompareCoverage(const Image& image, const OracleImage& reference);

// Two of the oracle's own, of the same pixels: R, G and B.
ImageError CompareColor(const OracleImage& image, const OracleImage& reference);

}  // namespace halflight::oracle
