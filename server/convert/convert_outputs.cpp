#include "server/convert/convert_outputs.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "renderer/light_buffer_size.h"
#include "server/convert/enums.h"

namespace halflight {
namespace {

bool ShowsLight(ImageKind kind) {
  return kind == ImageKind::kLightTransmittance || IsSeenFromLight(kind);
}

bool IsExr(ImageFormat format) {
  return format == ImageFormat::kExrHalf || format == ImageFormat::kExrFloat;
}

ImageFormat DefaultFormat(ImageKind kind) {
  if (kind == ImageKind::kBeauty || kind == ImageKind::kCoverage) {
    return ImageFormat::kPng8;
  }
  return IsSeenFromLight(kind) ? ImageFormat::kExrHalf : ImageFormat::kExrFloat;
}

// The light that an output shows: it must exist and cast shadows.
int ConvertLightIndex(const v1::Output& output, ImageKind kind, const Scene& scene,
                      const std::string& field, FieldChecks& checks) {
  const uint32_t index = output.light_index();
  if (!ShowsLight(kind)) {
    if (index != 0) {
      checks.Reject(field, fmt::format("{}", index),
                    "unset, unless the output shows a light (LIGHT_TRANSMITTANCE, LIGHT_BUFFER, "
                    "LIGHT_LAYERS)");
    }
    return 0;
  }
  if (scene.lights.empty()) {
    checks.Reject(field, fmt::format("{}", index), "nothing: the scene has no lights");
  } else if (index >= scene.lights.size()) {
    checks.Reject(field, fmt::format("{}", index), fmt::format("[0, {}]", scene.lights.size() - 1));
  } else if (!scene.lights[index].casts_shadows()) {
    checks.Reject(field, fmt::format("{}", index), "a light whose shadow density is not 0");
  }
  return static_cast<int>(index);
}

OutputJob ConvertOutput(const v1::Output& output, const Scene& scene, const std::string& path,
                        FieldChecks& checks) {
  OutputJob job;
  if (output.kind() == v1::OUTPUT_KIND_UNSPECIFIED) {
    checks.Reject(path + ".kind", "unset", "a kind of output");
  }
  const ImageKind kind =
      FromProto(kOutputKinds, output.kind(), ImageKind::kBeauty, path + ".kind", checks);
  job.shown.kind = kind;
  job.shown.light_index = ConvertLightIndex(output, kind, scene, path + ".light_index", checks);
  job.shown.quantity =
      FromProto(kQuantities, output.quantity(), job.shown.quantity, path + ".quantity", checks);
  if (output.quantity() != v1::LIGHT_QUANTITY_UNSPECIFIED && !IsSeenFromLight(kind)) {
    checks.Reject(path + ".quantity", fmt::format("{}", output.quantity()),
                  "unset, unless the output is LIGHT_BUFFER or LIGHT_LAYERS");
  }
  job.encoding.format =
      FromProto(kFormats, output.format(), DefaultFormat(kind), path + ".format", checks);
  job.encoding.compression = FromProto(kCompressions, output.compression(), ExrCompression::kZip,
                                       path + ".compression", checks);
  if (output.compression() != v1::EXR_COMPRESSION_UNSPECIFIED && !IsExr(job.encoding.format)) {
    checks.Reject(path + ".compression", fmt::format("{}", output.compression()),
                  "unset, unless the format is IMAGE_FORMAT_EXR_HALF or IMAGE_FORMAT_EXR_FLOAT");
  }
  return job;
}

uint64_t PixelBytesOf(const ImageRequest& shown, const Scene& scene) {
  uint64_t channels = shown.kind == ImageKind::kBeauty ? 4 : 1;
  if (shown.kind == ImageKind::kError ||
      (ShowsLight(shown.kind) && scene.lights[shown.light_index].colored_density())) {
    channels = 3;
  }
  uint64_t pixels = static_cast<uint64_t>(scene.camera.window.width) * scene.camera.window.height;
  if (IsSeenFromLight(shown.kind)) {
    // Layers are half-angle slicing's alone; the other may yet be drawn by whichever takes more.
    const auto technique = shown.kind == ImageKind::kLightLayers ? ShadowTechniqueKind::kHalfAngle
                                                                 : ShadowTechniqueKind::kLightSweep;
    const auto size = static_cast<uint64_t>(LargestLightBufferSize(scene.shadow, technique));
    pixels = size * size;
  }
  if (shown.kind == ImageKind::kLightLayers) {
    pixels *= std::clamp<uint64_t>(scene.particles->size(), 1, scene.shadow.slices);
  }
  return pixels * channels * sizeof(float);
}

}  // namespace

size_t IndexOfImage(std::vector<ImageRequest>& images, const ImageRequest& wanted) {
  const auto found = std::find_if(images.begin(), images.end(), [&](const ImageRequest& image) {
    return image.kind == wanted.kind && image.light_index == wanted.light_index &&
           image.quantity == wanted.quantity;
  });
  const size_t index = found - images.begin();
  if (found == images.end()) {
    images.push_back(wanted);
  }
  return index;
}

bool IsSeenFromLight(ImageKind kind) {
  return kind == ImageKind::kLightBuffer || kind == ImageKind::kLightLayers;
}

OutputPlan ConvertOutputs(const google::protobuf::RepeatedPtrField<v1::Output>& outputs,
                          const Scene& scene, const ServerLimits& limits, FieldChecks& checks) {
  OutputPlan plan;
  checks.InRange(
      "outputs", outputs.size(),
      {.low = 1.0, .high = static_cast<double>(limits.max_outputs), .server_limit = true});
  for (int i = 0; i < outputs.size() && checks.ok(); ++i) {
    OutputJob job = ConvertOutput(outputs[i], scene, fmt::format("outputs[{}]", i), checks);
    if (!checks.ok()) {
      break;
    }
    if (job.shown.kind != ImageKind::kError) {
      job.image = IndexOfImage(plan.images, job.shown);
    }
    plan.outputs.push_back(job);
  }
  plan.pixel_bytes = checks.ok() ? PixelBytes(plan.outputs, scene) : 0;
  if (plan.pixel_bytes > limits.max_output_bytes) {
    checks.Reject("outputs", fmt::format("{} bytes of pixels in 32-bit float", plan.pixel_bytes),
                  fmt::format("at most {}", limits.max_output_bytes), /*server_limit=*/true);
  }
  return plan;
}

uint64_t PixelBytes(const std::vector<OutputJob>& outputs, const Scene& scene) {
  uint64_t bytes = 0;
  for (const OutputJob& output : outputs) {
    bytes += PixelBytesOf(output.shown, scene);
  }
  return bytes;
}

v1::Output DescribeOutput(const OutputJob& job) {
  v1::Output described;
  described.set_kind(ToProto(kOutputKinds, job.shown.kind));
  described.set_format(ToProto(kFormats, job.encoding.format));
  if (IsExr(job.encoding.format)) {
    described.set_compression(ToProto(kCompressions, job.encoding.compression));
  }
  if (ShowsLight(job.shown.kind)) {
    described.set_light_index(job.shown.light_index);
  }
  if (IsSeenFromLight(job.shown.kind)) {
    described.set_quantity(ToProto(kQuantities, job.shown.quantity));
  }
  return described;
}

}  // namespace halflight
