// From composited samples to the image's pixels.
#pragma once

#include "absl/status/statusor.h"
#include "renderer/bands.h"
#include "renderer/gpu.h"
#include "renderer/scene.h"

namespace halflight {

// The pixels of a band: each the mean of n x n samples, or interpolated bilinearly between samples.
// Call only when sampling asks for either. `samples` holds the band's; there are as many in all as
// `composite_size` says.
absl::StatusOr<gl::Texture> ResolveSamples(Gpu& gpu, const gl::Texture& samples,
                                           const Sampling& sampling, const Band& band,
                                           const glm::ivec2& composite_size);

}  // namespace halflight
