// From composited samples to the image's pixels.
#pragma once

#include "absl/status/statusor.h"
#include "renderer/gpu.h"
#include "renderer/scene.h"

namespace halflight {

// A texture of `size` with the mean of n x n samples a pixel, or samples enlarged bilinearly. Call
// only when sampling asks for either; `samples` is as large as FramePlan::composite_size.
absl::StatusOr<gl::Texture> ResolveSamples(Gpu& gpu, const gl::Texture& samples,
                                           const Sampling& sampling, const glm::ivec2& size);

}  // namespace halflight
