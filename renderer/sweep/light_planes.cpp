#include "renderer/sweep/light_planes.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "renderer/blur_kernel.h"
#include "renderer/parallel.h"
#include "renderer/pixel_memory.h"
#include "renderer/sweep/kernels.h"

namespace halflight::sweep {

namespace {

// Lines that a core blurs at a time.
constexpr int kRows = 16;
constexpr int kColumnVectors = 2;

Image EmptyImage(const LightPlanes& planes) {
  Image image{planes.size, planes.size, 1, {"Y"}, {}};
  if (planes.depth.size() == 3) image.channels = {"R", "G", "B"};
  return image;
}

// What lines along an axis have in common.
struct Lines {
  bool rows = false;  // else columns, kLineLanes of them side by side
  int length = 0;     // texels
  int stride = 1;     // between texels of the kernel
};

// One pass of a kernel over one plane.
void BlurOnce(const Lines& lines, std::vector<float> weights, float density,
              std::vector<float>& depth, LightPlanes& planes, const std::stop_token& stop) {
  BlurLineJob job;
  // What reaches out of the buffer from everywhere in it meets nothing there.
  const size_t inside =
      std::min(weights.size(), static_cast<size_t>((lines.length - 1) / lines.stride + 1));
  job.outside =
      2.0F * std::accumulate(weights.begin() + static_cast<ptrdiff_t>(inside), weights.end(), 0.0F);
  weights.resize(inside);
  job.weights = weights.data();
  job.radius = static_cast<int>(inside) - 1;
  job.density = density;
  job.pitch = lines.rows ? kLineLanes : planes.pitch;
  job.vectors = lines.rows ? planes.pitch / kLineLanes : planes.size;
  job.tap = lines.rows ? lines.stride : lines.stride * kLineLanes;
  const auto blur = [&](size_t first, BlurLineJob line) {
    line.depth = &depth[first];
    line.unscattered = planes.unscattered.empty() ? nullptr : &planes.unscattered[first];
    BestKernels().blur_line(line);
  };
  const auto pitch = static_cast<size_t>(planes.pitch);
  const auto size = static_cast<size_t>(planes.size);
  const size_t count = lines.rows ? size : pitch / kLineLanes;
  const size_t at_a_time = lines.rows ? kRows : kColumnVectors;
  RunOnCores((count + at_a_time - 1) / at_a_time, [&](size_t task) {
    if (stop.stop_requested()) return;
    Block<float> scratch(static_cast<size_t>(BlurScratchFloats(job.vectors, job.radius, job.tap)));
    BlurLineJob line = job;
    line.scratch = scratch.data();
    const size_t end = std::min(count, (task + 1) * at_a_time);
    for (size_t i = task * at_a_time; i < end; ++i) {
      if (!lines.rows) {
        blur(i * kLineLanes, line);
        continue;
      }
      blur(i * pitch, line);
      std::fill(&depth[i * pitch] + size, &depth[i * pitch] + pitch, 0.0F);
    }
  });
}

void BlurAlongAxis(bool rows, const glm::dvec3& variance, const glm::vec3& density,
                   LightPlanes& planes, const std::stop_token& stop) {
  for (size_t c = 0; c < planes.depth.size(); ++c) {
    const auto channel = static_cast<glm::length_t>(c);
    if (!(density[channel] > 0.0F)) continue;
    for (const BlurStep& step : BlurSteps(glm::dvec3(variance[channel]), planes.size)) {
      BlurOnce({rows, planes.size, static_cast<int>(step.stride)},
               DiscreteGaussian(step.variance.x), density[channel], planes.depth[c], planes, stop);
    }
  }
}

}  // namespace

LightPlanes::LightPlanes(int texels, bool colored, bool keep_unscattered)
    : size(texels), pitch((texels + kLineLanes - 1) / kLineLanes * kLineLanes) {
  const std::vector<float> nothing(static_cast<size_t>(size) * static_cast<size_t>(pitch));
  depth.assign(colored ? 3 : 1, nothing);
  if (keep_unscattered) unscattered = nothing;
}

Image LightPlanes::ToImage() const {
  Image image = EmptyImage(*this);
  const size_t channels = depth.size();
  const auto width = static_cast<size_t>(size);
  image.pixels = Zeros(width * width * channels);
  ParallelRanges(width * width, [&](const WorkRange& range) {
    for (size_t i = range.begin; i < range.end; ++i) {
      const size_t at = i / width * static_cast<size_t>(pitch) + i % width;
      for (size_t c = 0; c < channels; ++c) image.pixels[i * channels + c] = depth[c][at];
    }
  });
  return image;
}

Image LightPlanes::TakeImage() && {
  if (depth.size() > 1 || pitch != size) return ToImage();
  Image image = EmptyImage(*this);
  image.pixels = std::move(depth.front());
  return image;
}

void BlurPlanes(const BlurVariance& variance, const glm::vec3& density, LightPlanes& planes,
                const std::stop_token& stop) {
  BlurAlongAxis(/*rows=*/true, variance.x, density, planes, stop);
  BlurAlongAxis(/*rows=*/false, variance.y, density, planes, stop);
}

}  // namespace halflight::sweep
