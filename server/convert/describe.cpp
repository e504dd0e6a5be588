#include "server/convert/describe.h"

#include <fmt/format.h>

#include "halflight/sha256.h"
#include "server/convert/convert_shadow.h"
#include "server/convert/geometry.h"

namespace halflight {
namespace {

void Fill(v1::Matrix4& message, const glm::dmat4& matrix) {
  for (int i = 0; i < 16; ++i) {
    message.add_elements(matrix[i % 4][i / 4]);
  }
}

v1::LightInfo DescribeLight(const LightReport& light) {
  v1::LightInfo info;
  info.set_casts_shadows(light.casts_shadows);
  if (!light.casts_shadows) {
    return info;
  }
  Fill(*info.mutable_world_to_light_texture(), light.light_texture_from_world);
  Fill(*info.mutable_world_to_light_camera(), light.light_view_from_world);
  info.mutable_slice_axis()->set_x(light.slice_axis.x);
  info.mutable_slice_axis()->set_y(light.slice_axis.y);
  info.mutable_slice_axis()->set_z(light.slice_axis.z);
  info.set_slices(light.slices);
  info.set_back_to_front(light.back_to_front);
  return info;
}

v1::FrameMetadata DescribeMetadata(const FrameJob& job, const FrameResult& result,
                                   const DeviceInfo& device, const std::string& server_version) {
  const Scene& scene = job.request.scene;
  v1::FrameMetadata metadata;
  metadata.set_request_id(job.request_id);
  metadata.set_gl_renderer(device.gl_renderer);
  metadata.set_gl_version(device.gl_version);
  metadata.set_particle_sha256(job.particle_sha256);
  metadata.set_particle_count(scene.particles->size());
  metadata.set_clamped_opacities(result.clamped_opacities);
  *metadata.mutable_shadow() = DescribeShadow(scene.shadow);
  metadata.mutable_shadow()->set_light_buffer_size(
      static_cast<uint32_t>(result.plan.light_buffer_size));
  Fill(*metadata.mutable_world_to_camera(), scene.camera.view_from_world);
  Fill(*metadata.mutable_world_to_ndc(), NdcFromWorld(scene.camera));
  for (const LightReport& light : result.lights) {
    *metadata.add_lights() = DescribeLight(light);
  }
  metadata.set_server_version(server_version);
  return metadata;
}

v1::ComparedFrame DescribeCompared(const MeasureJob& measure) {
  return measure.without_scattering ? v1::COMPARED_FRAME_WITHOUT_SCATTERING
                                    : v1::COMPARED_FRAME_RETURNED;
}

void Fill(v1::EstimatedFigure& message, const EstimatedFigure& figure) {
  message.set_value(figure.value);
  message.set_low(figure.low);
  message.set_high(figure.high);
}

v1::MeasuredError DescribeError(const MeasureJob& measure, const ErrorEstimate& error) {
  v1::MeasuredError described;
  described.set_compared(DescribeCompared(measure));
  described.set_covered_pixels(error.covered_pixels);
  described.set_sampled_pixels(error.sampled_pixels);
  if (measure.sample.has_value()) {
    *described.mutable_measurement() = DescribeMeasurement(*measure.sample);
  }
  Fill(*described.mutable_mean_square_error(), error.mean_square_error);
  Fill(*described.mutable_bias(), error.bias);
  Fill(*described.mutable_rmse(), error.rmse);
  Fill(*described.mutable_relative_rmse(), error.relative_rmse);
  described.set_reference_mean(error.reference_mean);
  described.set_sample_p999(error.sample_p999);
  described.set_sample_max(error.sample_max);
  for (const PixelError& worst : error.sample_worst) {
    v1::PixelError& pixel = *described.add_sample_worst();
    pixel.set_x(static_cast<uint32_t>(worst.pixel.x));
    pixel.set_y(static_cast<uint32_t>(worst.pixel.y));
    pixel.set_r(worst.error.r);
    pixel.set_g(worst.error.g);
    pixel.set_b(worst.error.b);
  }
  described.set_milliseconds(error.milliseconds);
  return described;
}

// What a file says of the error; "low" and "high" are the interval of the relative RMSE.
void AddErrorText(const MeasureJob& measure, const ErrorEstimate& error, ImageMetadata& metadata) {
  const auto add = [&metadata](const char* name, const std::string& value) {
    metadata.text.emplace_back(fmt::format("halflight:error.{}", name), value);
  };
  const auto number = [](double value) { return fmt::format("{:.6g}", value); };
  add("relativeRmse", number(error.relative_rmse.value));
  add("low", number(error.relative_rmse.low));
  add("high", number(error.relative_rmse.high));
  add("rmse", number(error.rmse.value));
  add("mse", number(error.mean_square_error.value));
  add("bias", number(error.bias.value));
  add("samples", fmt::format("{}", error.sampled_pixels));
  add("coveredPixels", fmt::format("{}", error.covered_pixels));
  add("compared", v1::ComparedFrame_Name(DescribeCompared(measure)));
}

v1::Sampling DescribeSampling(const Sampling& sampling) {
  v1::Sampling described;
  if (sampling.downsample > 1) {
    described.set_downsample(static_cast<uint32_t>(sampling.downsample));
  } else {
    described.set_supersample(static_cast<uint32_t>(sampling.supersample));
  }
  return described;
}

v1::TargetOutcome DescribeOutcome(const TargetGoal& goal, const TargetOutcome& outcome) {
  v1::TargetOutcome described;
  *described.mutable_target() = DescribeTarget(goal);
  described.set_met(outcome.met);
  described.set_reason(outcome.reason);
  for (const TargetAttempt& attempt : outcome.attempts) {
    v1::TargetAttempt& tried = *described.add_attempts();
    *tried.mutable_shadow() = DescribeShadow(attempt.settings.shadow);
    *tried.mutable_sampling() = DescribeSampling(attempt.settings.sampling);
    tried.set_expected_milliseconds(attempt.expected_milliseconds);
    tried.set_milliseconds(attempt.milliseconds);
    if (attempt.relative_rmse.has_value()) {
      Fill(*tried.mutable_relative_rmse(), *attempt.relative_rmse);
    }
    tried.set_met(attempt.met);
  }
  if (outcome.returned.has_value()) {
    described.mutable_attempts(static_cast<int>(*outcome.returned))->set_returned(true);
  }
  return described;
}

void AddTargetText(const TargetGoal& goal, const TargetOutcome& outcome, ImageMetadata& metadata) {
  metadata.text.emplace_back("halflight:target.met", outcome.met ? "true" : "false");
  if (goal.max_error.has_value()) {
    metadata.text.emplace_back("halflight:target.maxError", fmt::format("{:.6g}", *goal.max_error));
  }
  if (goal.max_time_ms.has_value()) {
    metadata.text.emplace_back("halflight:target.maxTimeMs",
                               fmt::format("{:.6g}", *goal.max_time_ms));
  }
}

v1::OutputInfo DescribeEncoded(const OutputJob& output, const Image& image,
                               const EncodedImage& encoded) {
  v1::OutputInfo info;
  *info.mutable_output() = DescribeOutput(output);
  info.set_width(image.width);
  info.set_height(image.height);
  info.set_layers(image.layers);
  for (const std::string& channel : image.channels) {
    info.add_channels(channel);
  }
  info.set_media_type(encoded.media_type);
  info.set_byte_size(encoded.bytes.size());
  if (encoded.white_black.has_value()) {
    info.set_white_value(encoded.white_black->first);
    info.set_black_value(encoded.white_black->second);
  }
  return info;
}

}  // namespace

ImageMetadata DescribeImage(const FrameJob& job, const MadeFrame& frame, const OutputJob& output,
                            const DeviceInfo& device, const std::string& server_version) {
  const Scene& scene = job.request.scene;
  v1::Shadow shadow = DescribeShadow(scene.shadow);
  shadow.set_light_buffer_size(static_cast<uint32_t>(frame.rendered.plan.light_buffer_size));
  const v1::Output described = DescribeOutput(output);
  ImageMetadata metadata;
  metadata.text = {
      {"halflight:particles", ToHex(job.particle_sha256)},
      {"halflight:output", v1::OutputKind_Name(described.kind())},
      {"halflight:technique", v1::ShadowTechnique_Name(shadow.technique())},
      {"halflight:slices", fmt::format("{}", shadow.slices())},
      {"halflight:interpolate", shadow.interpolate() ? "true" : "false"},
      {"halflight:spacing", v1::SliceSpacing_Name(shadow.spacing())},
      {"halflight:compositor", v1::SliceCompositor_Name(shadow.compositor())},
      {"halflight:lightBufferSize", fmt::format("{}", shadow.light_buffer_size())},
      {"halflight:blurMode", v1::BlurMode_Name(shadow.blur_mode())},
      {"halflight:blurTexels", fmt::format("{}", shadow.blur_texels())},
      {"halflight:fitDegree", fmt::format("{}", shadow.fit_degree())},
      {"halflight:renderer", device.gl_renderer},
      {"halflight:version", server_version},
  };
  if (job.target.has_value() && frame.target.has_value()) {
    AddTargetText(job.target->goal, *frame.target, metadata);
  }
  if (IsSeenFromLight(output.shown.kind)) {
    const std::vector<LightReport>& lights = frame.rendered.lights;
    const auto index = static_cast<size_t>(output.shown.light_index);
    metadata.text.emplace_back("halflight:light", fmt::format("{}", index));
    metadata.text.emplace_back("halflight:quantity", v1::LightQuantity_Name(described.quantity()));
    if (index < lights.size()) {
      metadata.world_to_camera = lights[index].light_view_from_world;
      metadata.world_to_ndc = lights[index].light_texture_from_world;
    }
    return metadata;
  }
  if (job.measure.has_value() && frame.error.has_value()) {
    AddErrorText(*job.measure, *frame.error, metadata);
  }
  metadata.world_to_camera = scene.camera.view_from_world;
  metadata.world_to_ndc = NdcFromWorld(scene.camera);
  metadata.data_window = scene.camera.window;
  metadata.display_size = {scene.camera.width, scene.camera.height};
  return metadata;
}

v1::FrameHeader DescribeFrame(const FrameJob& job, const MadeFrame& frame,
                              const std::vector<EncodedImage>& encoded, const DeviceInfo& device,
                              const std::string& server_version) {
  const FrameResult& result = frame.rendered;
  v1::FrameHeader header;
  *header.mutable_metadata() = DescribeMetadata(job, result, device, server_version);
  for (const PlannedPass& pass : result.plan.passes) {
    v1::PlannedPass& planned = *header.mutable_plan()->add_passes();
    planned.set_name(pass.name);
    planned.set_reason(pass.reason);
    planned.set_count(pass.count);
  }
  for (const StageTiming& timing : result.timings) {
    v1::StageTiming& stage = *header.add_timings();
    stage.set_stage(timing.stage);
    stage.set_milliseconds(timing.milliseconds);
  }
  if (job.measure.has_value() && frame.error.has_value()) {
    *header.mutable_error() = DescribeError(*job.measure, *frame.error);
  }
  if (job.target.has_value() && frame.target.has_value()) {
    *header.mutable_target() = DescribeOutcome(job.target->goal, *frame.target);
  }
  for (size_t i = 0; i < encoded.size(); ++i) {
    const OutputJob& output = job.outputs[i];
    *header.add_outputs() = DescribeEncoded(output, result.images[output.image], encoded[i]);
  }
  return header;
}

}  // namespace halflight
