// Which walks half-angle slicing takes, and what light reaches a particle in them.
// The walk itself is the reference's compositor.
#include "tests/oracle/oracle.h"

#include <memory>
#include <stop_token>
#include <utility>

#include "renderer/reference/compositor.h"
#include "renderer/reference/evaluator.h"
#include "renderer/reference/eye.h"
#include "renderer/reference/light_depth.h"
#include "tests/oracle/half_angle.h"

namespace halflight::oracle {
namespace {

using reference::Cloud;
using reference::LightDepth;
using reference::Pass;
using reference::Rays;
using reference::RaysOf;

std::vector<uint32_t> RanksOf(const std::vector<uint32_t>& order) {
  std::vector<uint32_t> ranks(order.size());
  for (size_t rank = 0; rank < order.size(); ++rank) {
    ranks[order[rank]] = static_cast<uint32_t>(rank);
  }
  return ranks;
}

// Of the slices before a particle's own, and when interpolated its share of its own slice, itself
// left out.
reference::DepthFromLight SlicedDepth(const Rays& rays, const Cloud& cloud,
                                      const HalfAngleOrder& order, bool interpolate) {
  const auto buffer =
      std::make_shared<const LightDepth>(rays, cloud, order.order, std::stop_token());
  return [buffer, interpolate, places = order.places](const glm::dvec3& x, uint32_t particle,
                                                      double enough) {
    const uint32_t rank = buffer->ranks()[particle];
    const SlicePlace& place = places[rank];
    const double before = buffer->Between(x, 0, place.begin, enough);
    if (!interpolate || before > enough || place.fraction == 0.0) return before;
    return before + place.fraction * (buffer->Between(x, place.begin, rank) +
                                      buffer->Between(x, rank + 1, place.end));
  };
}

// The walk for one light that casts shadows.
Pass HalfAnglePass(size_t index, const Scene& scene, const Cloud& cloud) {
  const Light& light = scene.lights[index];
  const Rays rays = RaysOf(light, scene);
  const HalfAngleOrder order =
      OrderByHalfAngle(cloud, rays, reference::Eye(scene).forward(), scene.shadow);
  Pass pass;
  pass.nearness = RanksOf(order.order);
  if (order.back_to_front) {
    for (uint32_t& rank : pass.nearness)
      rank = static_cast<uint32_t>(order.order.size()) - 1 - rank;
  }
  pass.lights.push_back(
      {index, light, rays, SlicedDepth(rays, cloud, order, scene.shadow.interpolate)});
  return pass;
}

// The walk of a scene without shadows.
Pass CenterDistancePass(const Scene& scene, const Cloud& cloud) {
  Pass pass;
  pass.nearness = RanksOf(reference::OrderFromLight(reference::Eye(scene).rays(), cloud, {}));
  return pass;
}

std::vector<glm::ivec2> PixelsOf(const Scene& scene, const OracleOptions& options) {
  std::vector<glm::ivec2> pixels;
  for (int y = options.stride / 2; y < scene.camera.window.height; y += options.stride) {
    for (int x = options.stride / 2; x < scene.camera.window.width; x += options.stride) {
      pixels.emplace_back(x, y);
    }
  }
  return pixels;
}

OracleImage ImageOf(const Scene& scene, std::vector<glm::ivec2> pixels,
                    reference::PixelValues values) {
  return {.width = scene.camera.window.width,
          .height = scene.camera.window.height,
          .pixels = std::move(pixels),
          .rgba = std::move(values.rgba),
          .depth = std::move(values.depth),
          .transmittance = std::move(values.transmittance)};
}

OracleImage Composite(const Scene& scene, const Cloud& cloud, std::vector<Pass> passes,
                      const OracleOptions& options) {
  const reference::Compositor compositor(scene, cloud, reference::IndexedEye(scene, cloud, {}),
                                         std::move(passes));
  std::vector<glm::ivec2> pixels = PixelsOf(scene, options);
  // Without a stop, nothing can fail.
  reference::PixelValues values =
      *reference::EvaluatePixels(compositor, pixels, {.threads = options.threads});
  return ImageOf(scene, std::move(pixels), std::move(values));
}

}  // namespace

OracleImage RenderUnshadowed(const Scene& scene, const OracleOptions& options) {
  Scene open = scene;
  for (Light& light : open.lights) light.shadow_density = glm::vec3(0.0F);
  return RenderExact(open, options);
}

OracleImage RenderExact(const Scene& scene, const OracleOptions& options) {
  std::vector<glm::ivec2> pixels = PixelsOf(scene, options);
  reference::PixelValues values =
      *(*reference::Evaluator::Create(scene))->Evaluate(pixels, {.threads = options.threads});
  return ImageOf(scene, std::move(pixels), std::move(values));
}

OracleImage RenderHalfAngle(const Scene& scene, const OracleOptions& options) {
  const Cloud cloud = reference::ResolveCloud(scene);
  std::vector<Pass> passes;
  for (size_t light = 0; light < scene.lights.size(); ++light) {
    if (scene.lights[light].casts_shadows()) {
      passes.push_back(HalfAnglePass(light, scene, cloud));
    }
  }
  if (passes.empty()) passes.push_back(CenterDistancePass(scene, cloud));
  passes.front().ambient_and_emission = true;
  for (size_t index = 0; index < scene.lights.size(); ++index) {
    const Light& light = scene.lights[index];
    if (!light.casts_shadows()) {
      passes.front().lights.push_back({index, light, RaysOf(light, scene), nullptr});
    }
  }
  return Composite(scene, cloud, std::move(passes), options);
}

}  // namespace halflight::oracle
