// The image model (docs/image-model.md) evaluated exactly, in float64 on the CPU: what techniques
// are judged by. Start reading here. Leaves out what the model leaves out: scattering, light
// buffers, and pixels that are not sampled (Sampling::downsample is ignored: every pixel is).
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "absl/status/statusor.h"
#include "renderer/reference/cloud.h"
#include "renderer/reference/compositor.h"
#include "renderer/scene.h"

namespace halflight::reference {

class IndexCache;

// One element for each pixel evaluated.
struct PixelValues {
  std::vector<glm::dvec4> rgba;  // premultiplied
  // Coverage-weighted mean of the depth of x_i along the camera's axis; infinity where nothing is
  // covered.
  std::vector<double> depth;
  // By light of the scene, then by pixel: the coverage-weighted mean at x_i; 1 where nothing is
  // covered.
  std::vector<std::vector<glm::dvec3>> transmittance;
};

struct EvaluateOptions {
  int threads = 0;  // 0: as many as there are cores
  std::stop_token stop{};
  // Called with the number of pixels done, ascending, and of all. By any thread, one at a time.
  std::function<void(size_t done, size_t total)> progress{};
};

class Evaluator {
 public:
  // Sorts and indexes the particles for the eye and for every light that casts shadows, or takes
  // from `kept` what it has of that, and leaves there what it has not. Keeps nothing of the scene.
  // Cancelled soon after `stop` was requested.
  static absl::StatusOr<std::unique_ptr<const Evaluator>> Create(const Scene& scene,
                                                                 const std::stop_token& stop = {},
                                                                 IndexCache* kept = nullptr);

  // At places in the camera's window. The value of a pixel does not depend on which others are
  // evaluated, nor on the number of threads, to the last bit. Cancelled soon after the stop was
  // requested. Any thread.
  [[nodiscard]] absl::StatusOr<PixelValues> Evaluate(std::span<const glm::ivec2> pixels,
                                                     const EvaluateOptions& options = {}) const;

  // At all places of the window, row by row from the top.
  [[nodiscard]] absl::StatusOr<PixelValues> EvaluateWindow(
      const EvaluateOptions& options = {}) const;

 private:
  explicit Evaluator(const PixelRect& window) : window_(window) {}

  PixelRect window_;
  std::shared_ptr<const Cloud> cloud_;  // which the compositor refers to
  std::unique_ptr<const Compositor> compositor_;
};

// What Evaluate does with a compositor of any passes.
absl::StatusOr<PixelValues> EvaluatePixels(const Compositor& compositor,
                                           std::span<const glm::ivec2> pixels,
                                           const EvaluateOptions& options);

// All places of a window of this size, row by row from the top.
std::vector<glm::ivec2> PixelsOf(const PixelRect& window);

}  // namespace halflight::reference
