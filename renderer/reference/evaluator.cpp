#include "renderer/reference/evaluator.h"

#include <algorithm>
#include <atomic>
#include <future>
#include <limits>
#include <mutex>
#include <thread>

#include "absl/status/status.h"
#include "renderer/reference/index_cache.h"
#include "renderer/reference/light_depth.h"

namespace halflight::reference {
namespace {

// Of one light, with the particles sorted and indexed for it, if it casts shadows.
PassLight ShadowedLight(size_t index, const Scene& scene, const Cloud& cloud, IndexCache& kept,
                        const std::stop_token& stop) {
  const Light& light = scene.lights[index];
  const Rays rays = RaysOf(light, scene);
  if (!light.casts_shadows()) return {index, light, rays, nullptr};
  const std::shared_ptr<const LightDepth> buffer = kept.DepthOf(scene, cloud, rays, stop);
  return {index, light, rays, [buffer](const glm::dvec3& x, uint32_t particle, double enough) {
            return buffer->Between(x, 0, buffer->ranks()[particle], enough);
          }};
}

void Store(const PixelSample& sample, size_t i, PixelValues& values) {
  const double coverage = sample.rgba.a;
  values.rgba[i] = sample.rgba;
  values.depth[i] =
      coverage > 0.0 ? sample.depth / coverage : std::numeric_limits<double>::infinity();
  for (size_t light = 0; light < values.transmittance.size(); ++light) {
    values.transmittance[light][i] =
        coverage > 0.0 ? sample.transmittance[light] / coverage : glm::dvec3(1.0);
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<const Evaluator>> Evaluator::Create(const Scene& scene,
                                                                   const std::stop_token& stop,
                                                                   IndexCache* kept) {
  IndexCache own(0);
  IndexCache& indexes = kept != nullptr ? *kept : own;
  std::unique_ptr<Evaluator> evaluator(new Evaluator(scene.camera.window));
  evaluator->cloud_ = indexes.ParticlesOf(scene);
  const Cloud& cloud = *evaluator->cloud_;
  // The eye's index and those of the lights are made at the same time.
  std::vector<std::future<PassLight>> lights;
  for (size_t light = 0; light < scene.lights.size(); ++light) {
    const auto policy =
        scene.lights[light].casts_shadows() ? std::launch::async : std::launch::deferred;
    lights.push_back(std::async(policy, [&scene, &cloud, &indexes, &stop, light] {
      return ShadowedLight(light, scene, cloud, indexes, stop);
    }));
  }
  const Eye camera(scene);
  IndexedEye eye(camera, indexes.EyeIndexOf(scene, cloud, camera.rays(), stop));
  Pass pass{.nearness = {}, .ambient_and_emission = true, .lights = {}};
  for (std::future<PassLight>& light : lights) pass.lights.push_back(light.get());
  evaluator->compositor_ = std::make_unique<const Compositor>(scene, cloud, std::move(eye),
                                                              std::vector<Pass>{std::move(pass)});
  if (stop.stop_requested()) return absl::CancelledError("reference cancelled");
  return std::unique_ptr<const Evaluator>(std::move(evaluator));
}

absl::StatusOr<PixelValues> Evaluator::Evaluate(std::span<const glm::ivec2> pixels,
                                                const EvaluateOptions& options) const {
  return EvaluatePixels(*compositor_, pixels, options);
}

absl::StatusOr<PixelValues> Evaluator::EvaluateWindow(const EvaluateOptions& options) const {
  return Evaluate(PixelsOf(window_), options);
}

absl::StatusOr<PixelValues> EvaluatePixels(const Compositor& compositor,
                                           std::span<const glm::ivec2> pixels,
                                           const EvaluateOptions& options) {
  const size_t count = pixels.size();
  PixelValues values;
  values.rgba.resize(count);
  values.depth.resize(count);
  values.transmittance.assign(compositor.light_count(), std::vector<glm::dvec3>(count));

  std::atomic<size_t> next{0};
  std::mutex progress_mutex;
  size_t done = 0;  // guarded by progress_mutex
  const auto work = [&] {
    constexpr size_t kBatch = 16;  // neighbours: what one needs is still in the cache for the next
    for (size_t begin = next.fetch_add(kBatch); begin < count; begin = next.fetch_add(kBatch)) {
      const size_t end = std::min(begin + kBatch, count);
      for (size_t i = begin; i < end; ++i) {
        if (options.stop.stop_requested()) return;
        Store(compositor.Evaluate(pixels[i], options.stop), i, values);
      }
      if (!options.progress) continue;
      const std::lock_guard lock(progress_mutex);
      done += end - begin;
      options.progress(done, count);
    }
  };
  const int threads = options.threads > 0
                          ? options.threads
                          : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back(work);
    work();
  }
  if (options.stop.stop_requested()) return absl::CancelledError("reference cancelled");
  return values;
}

std::vector<glm::ivec2> PixelsOf(const PixelRect& window) {
  std::vector<glm::ivec2> pixels;
  pixels.reserve(static_cast<size_t>(window.width) * static_cast<size_t>(window.height));
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) pixels.emplace_back(x, y);
  }
  return pixels;
}

}  // namespace halflight::reference
