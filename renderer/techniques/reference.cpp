#include "renderer/techniques/reference.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "renderer/reference/evaluator.h"
#include "renderer/stage_clock.h"

namespace halflight {

namespace {

constexpr char kName[] = "REFERENCE";

absl::Status CheckOutputs(const std::vector<ImageRequest>& images) {
  for (const ImageRequest& image : images) {
    if (image.kind == ImageKind::kLightBuffer || image.kind == ImageKind::kLightLayers) {
      return Refuse("outputs",
                    image.kind == ImageKind::kLightBuffer ? "light buffer" : "light layers", kName,
                    "beauty, coverage, depth, light transmittance");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckScene(const Scene& scene) {
  if (scene.sampling.downsample > 1) {
    return Refuse("sampling.downsample", absl::StrCat(scene.sampling.downsample), kName,
                  "1, since it samples every pixel");
  }
  return CheckNoScattering(scene, kName, "the image model has no scattering");
}

// An image whose pixel i has `value(i, channel)`.
template <typename Value>
Image MakeImage(const PixelRect& window, std::vector<std::string> channels, const Value& value) {
  Image image{window.width, window.height, 1, std::move(channels), {}};
  const size_t pixels = static_cast<size_t>(window.width) * static_cast<size_t>(window.height);
  image.pixels.reserve(pixels * image.channels.size());
  for (size_t i = 0; i < pixels; ++i) {
    for (size_t channel = 0; channel < image.channels.size(); ++channel) {
      image.pixels.push_back(static_cast<float>(value(i, static_cast<glm::length_t>(channel))));
    }
  }
  return image;
}

Image SelectImage(const ImageRequest& request, const Scene& scene,
                  const reference::PixelValues& values) {
  const PixelRect& window = scene.camera.window;
  switch (request.kind) {
    case ImageKind::kCoverage:
      return MakeImage(window, {"A"}, [&](size_t i, auto) { return values.rgba[i].a; });
    case ImageKind::kDepth:
      return MakeImage(window, {"Z"}, [&](size_t i, auto) { return values.depth[i]; });
    case ImageKind::kLightTransmittance: {
      const auto light = static_cast<size_t>(request.light_index);
      const bool colored = scene.lights[light].colored_density();
      return MakeImage(
          window, colored ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{"Y"},
          [&](size_t i, auto channel) { return values.transmittance[light][i][channel]; });
    }
    case ImageKind::kBeauty:
    case ImageKind::kLightBuffer:
    case ImageKind::kLightLayers:
    case ImageKind::kError:
      break;
  }
  return MakeImage(window, {"R", "G", "B", "A"},
                   [&](size_t i, auto channel) { return values.rgba[i][channel]; });
}

}  // namespace

absl::Status Reference::Check(const FrameRequest& request) const {
  if (absl::Status status = CheckOutputs(request.images); !status.ok()) return status;
  return CheckScene(request.scene);
}

absl::Status Reference::Plan(const FrameRequest& /*request*/, const ParticleView& /*particles*/,
                             FramePlan& plan) const {
  plan.passes.push_back(
      {"evaluate the image model in float64", "technique REFERENCE, on the CPU", 1});
  return absl::OkStatus();
}

absl::StatusOr<DrawnFrame> Reference::Draw(const DrawContext& context) const {
  const Scene& scene = context.request.scene;
  context.clock.BeginCpu("reference");
  auto evaluator = reference::Evaluator::Create(scene, context.stop);
  if (!evaluator.ok()) return evaluator.status();
  reference::EvaluateOptions options;
  options.stop = context.stop;
  const absl::StatusOr<reference::PixelValues> values = (*evaluator)->EvaluateWindow(options);
  if (!values.ok()) return values.status();
  DrawnFrame frame;
  for (const ImageRequest& image : context.request.images) {
    frame.images.push_back(SelectImage(image, scene, *values));
  }
  for (const Light& light : scene.lights) {
    LightReport report;
    report.casts_shadows = light.casts_shadows();
    frame.reports.push_back(report);
  }
  return frame;
}

}  // namespace halflight
