#include "renderer/sweep/light_fit.h"

#include <iterator>
#include <optional>
#include <span>
#include <utility>

#include "renderer/light_spread.h"
#include "renderer/particle_order.h"
#include "renderer/sweep/light_planes.h"
#include "renderer/sweep/light_runs.h"
#include "renderer/sweep/light_slabs.h"
#include "renderer/sweep/polynomial.h"
#include "renderer/sweep/sprites.h"

namespace halflight::sweep {

namespace {

// Puts a layer of the same size behind those that are there, or begins them.
void AppendLayer(Image layer, Image& layers) {
  if (layers.pixels.empty()) {
    layers = std::move(layer);
    return;
  }
  layers.pixels.insert(layers.pixels.end(), layer.pixels.begin(), layer.pixels.end());
  ++layers.layers;
}

// Runs of one slab.
std::vector<TileRun> RunsOf(const SpriteList& list, const TileRun& slab, const RunLimits& limits) {
  std::vector<TileRun> runs =
      CutIntoRuns(std::span(list.rects).subspan(slab.begin, slab.size()), kLightTile, limits);
  for (TileRun& run : runs) {
    run.begin += slab.begin;
    run.end += slab.begin;
  }
  return runs;
}

}  // namespace

Traversal PlanLight(const Scene& scene, const ParticleView& particles, int light,
                    bool keep_layers) {
  Traversal traversal = PlanLightBuffer(scene, particles, light);
  traversal.axis = TravelDirection(scene.lights[static_cast<size_t>(light)], particles);
  traversal.keep_layers = keep_layers;
  const bool layered = IsLayered(scene);
  if (!traversal.blur && !keep_layers && !layered) traversal.slices = 1;
  if (layered || traversal.slices == 1) traversal.spacing = SliceSpacing::kEqualCount;
  return traversal;
}

absl::StatusOr<LightFit> FitLight(const Scene& scene, const ParticleView& particles,
                                  const Traversal& traversal, const std::stop_token& stop,
                                  const RunLimits& limits) {
  const Light& light = scene.lights[static_cast<size_t>(*traversal.shadow_light)];
  const int size = traversal.light_buffer_size;
  std::optional<LightSpread> spread;
  if (traversal.blur) spread.emplace(scene, light, particles, *traversal.axis);
  LightFit fit;
  fit.projection = LightProjection(light, particles, size, spread ? spread->Border() : 0.0);
  fit.degree = scene.shadow.fit_degree;
  fit.channels = traversal.colored_light_buffer ? 3 : 1;
  const SpriteList list = ListSprites(particles, fit.projection);
  fit.depth.resize(particles.size() * static_cast<size_t>(fit.channels * Terms(fit.degree)));

  const bool layered = IsLayered(scene);
  const LightWay way(light, particles);
  UniformSlabs cut;
  if (layered) {
    cut = CutLightUniformly(way, list.particles, traversal.slices);
  } else {
    cut.begin = CutIntoSlices(particles, list.particles, traversal.slices, traversal.spacing);
  }
  SlabPositions positions;
  if (spread) positions = PlaceSlabs(way, list.particles, cut.begin);

  LightPlanes planes(size, traversal.colored_light_buffer, traversal.keep_unscattered);
  const glm::dvec2 texels_per_unit = TexelsPerUnit(fit.projection, particles);
  const auto blur = [&](double from, double to) {
    BlurPlanes(spread->InTexels(from, to, texels_per_unit), light.shadow_density, planes, stop);
  };
  LightRuns light_runs(list, scene.material, layered ? cut.places.data() : nullptr, planes, fit);
  for (size_t s = 0; s + 1 < cut.begin.size(); ++s) {
    if (spread && s > 0) blur(positions.middle[s - 1], positions.middle[s]);
    const TileRun slab{cut.begin[s], cut.begin[s + 1]};
    // Also of slabs that hold nothing, of which there may be many.
    if (stop.stop_requested() || !light_runs.SweepSlab(RunsOf(list, slab, limits), stop)) {
      return absl::CancelledError("frame cancelled");
    }
    if (traversal.keep_layers) AppendLayer(planes.ToImage(), fit.layers);
  }
  // The buffer stands at the middle of the last slab; shown is the light behind all particles.
  if (spread) blur(positions.middle.back(), positions.end);
  if (stop.stop_requested()) return absl::CancelledError("frame cancelled");
  fit.optical_depth = std::move(planes).TakeImage();
  return fit;
}

}  // namespace halflight::sweep
