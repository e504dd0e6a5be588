// What a target asks of a frame, by the request, and what it leaves to be chosen. What is refused
// stands in validation_test.

#include "server/convert/convert_target.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/convert/convert_frame.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using testing::MakeRequest;
using testing::MustConvert;

v1::RenderFrameRequest TargetRequest() {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_target()->set_max_error(0.05);
  return request;
}

TEST(ConvertTarget, TakesGoalsAndTheServersLimits) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_target()->set_max_time_ms(40.0);
  ServerLimits limits;
  limits.max_slices = 300;
  limits.max_light_buffer_size = 1000;
  limits.max_reference_work = 4000000;
  const FrameJob job = MustConvert(request, limits);
  ASSERT_TRUE(job.target.has_value());
  EXPECT_EQ(job.target->goal.max_error, 0.05);
  EXPECT_EQ(job.target->goal.max_time_ms, 40.0);
  EXPECT_EQ(job.target->goal.samples, 1024);
  EXPECT_EQ(job.target->limits.max_slices, 300);
  EXPECT_EQ(job.target->limits.max_light_buffer_size, 1000);
  EXPECT_EQ(job.target->limits.max_reference_work, 4e6);
  EXPECT_TRUE(job.target->limits.may_downsample);
  EXPECT_EQ(DescribeTarget(job.target->goal).ShortDebugString(),
            request.target().ShortDebugString());
  EXPECT_FALSE(MustConvert(MakeRequest()).target.has_value());
}

TEST(ConvertTarget, KeepsTheSamplingThatIsSet) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_scene()->mutable_sampling()->set_supersample(2);
  const FrameJob job = MustConvert(request);
  EXPECT_FALSE(job.target->limits.may_downsample);
  EXPECT_EQ(job.request.scene.sampling.supersample, 2);
}

TEST(ConvertTarget, OfAnErrorMeasuresTheBeautyAlsoUnasked) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_DEPTH);
  const FrameJob job = MustConvert(request);
  ASSERT_TRUE(job.measure.has_value());
  EXPECT_EQ(job.measure->sample->samples, 1024);
  EXPECT_EQ(job.measure->sample->seed, 0U);
  EXPECT_EQ(job.request.images.at(job.measure->beauty).kind, ImageKind::kBeauty);
  request.mutable_measure_error()->set_samples(200);
  EXPECT_EQ(MustConvert(request).target->goal.samples, 200);
  request.clear_measure_error();
  request.mutable_target()->clear_max_error();
  request.mutable_target()->set_max_time_ms(1.0);
  EXPECT_FALSE(MustConvert(request).measure.has_value());
}

TEST(ConvertTarget, LeavesTheTechniquesNeedsToTheSearch) {
  v1::RenderFrameRequest request = TargetRequest();
  v1::Light& light = *request.mutable_scene()->mutable_lighting()->mutable_lights(0);
  light.mutable_point()->mutable_position()->set_x(0.5);
  EXPECT_TRUE(MustConvert(request).target.has_value());
}

TEST(ConvertTarget, OffersNoSettingsWhoseOutputsAreTooLarge) {
  v1::RenderFrameRequest request = TargetRequest();
  request.mutable_scene()->mutable_inline_particles()->CopyFrom(
      testing::MakeParticles(5000, {v1::PARTICLE_ATTRIBUTE_POSITION}));
  request.mutable_scene()->mutable_material()->set_radius(0.1F);
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_LIGHT_LAYERS);
  ServerLimits limits;
  limits.max_output_bytes = 256 * kMiB;
  const FrameJob layers = MustConvert(request, limits);
  const TargetLimits& offered = layers.target->limits;
  const uint64_t texels =
      uint64_t{1} * offered.max_light_buffer_size * offered.max_light_buffer_size;
  EXPECT_LE(4 * texels * offered.max_slices, limits.max_output_bytes);
  const auto& window = layers.request.scene.camera.window;
  const uint64_t measured = uint64_t{16} * window.width * window.height;
  EXPECT_LE(layers.pixel_bytes, 2 * (limits.max_output_bytes + measured));
  EXPECT_GE(offered.max_slices, 128) << "what it would be without a target";
  EXPECT_GE(offered.max_light_buffer_size, 256);
  // One buffer alone does not depend on slices.
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_LIGHT_BUFFER);
  const FrameJob buffer = MustConvert(request, limits);
  EXPECT_EQ(buffer.target->limits.max_slices, 65536);
  EXPECT_EQ(buffer.target->limits.max_light_buffer_size, 4096);
  EXPECT_EQ(buffer.pixel_bytes, 2 * (64 * kMiB + measured));
}

}  // namespace
}  // namespace halflight
