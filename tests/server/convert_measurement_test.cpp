// What is measured of a frame, by the request; and what is told of the error that was measured.
// What is refused stands in validation_test.

#include "server/convert/convert_measurement.h"

#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/convert/convert_frame.h"
#include "server/convert/describe.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using testing::FakeImage;
using testing::MakeRequest;
using testing::MustConvert;

TEST(ConvertMeasurement, MeasuresNothingThatIsNotAskedFor) {
  EXPECT_FALSE(MustConvert(MakeRequest()).measure.has_value());
}

TEST(ConvertMeasurement, MeasuresTheBeautyThatAnOutputShows) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_DEPTH);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_BEAUTY);
  request.mutable_measure_error();
  const FrameJob job = MustConvert(request);
  ASSERT_TRUE(job.measure.has_value());
  EXPECT_EQ(job.request.images.size(), 2U);
  EXPECT_EQ(job.measure->beauty, 1U);
  EXPECT_FALSE(job.measure->map);
  EXPECT_FALSE(job.measure->without_scattering);
  ASSERT_TRUE(job.measure->sample.has_value());
  EXPECT_EQ(job.measure->sample->samples, 1024);
  EXPECT_EQ(job.measure->sample->seed, 0U);
}

TEST(ConvertMeasurement, MeasuresABeautyThatNoOutputShows) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_COVERAGE);
  request.mutable_measure_error()->set_samples(64);
  request.mutable_measure_error()->set_seed(uint64_t{1} << 63U);
  const FrameJob job = MustConvert(request);
  ASSERT_EQ(job.request.images.size(), 2U);
  EXPECT_EQ(job.request.images[job.measure->beauty].kind, ImageKind::kBeauty);
  EXPECT_EQ(job.measure->sample->samples, 64);
  EXPECT_EQ(job.measure->sample->seed, uint64_t{1} << 63U);
}

TEST(ConvertMeasurement, PictureThatIsDrawnForItCounts) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->mutable_camera()->set_width(100);
  request.mutable_scene()->mutable_camera()->set_height(10);
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_COVERAGE);
  EXPECT_EQ(MustConvert(request).pixel_bytes, 4000U);
  request.mutable_measure_error();
  EXPECT_EQ(MustConvert(request).pixel_bytes, 4000U + 16000U);
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_BEAUTY);
  EXPECT_EQ(MustConvert(request).pixel_bytes, 16000U) << "the one that is shown does";
  request.mutable_scene()->mutable_material()->set_scattering_spread(0.5F);
  EXPECT_EQ(MustConvert(request).pixel_bytes, 2 * 16000U);
  request.mutable_target()->set_max_error(0.01F);
  EXPECT_EQ(MustConvert(request).pixel_bytes, 4 * 16000U) << "of one attempt beside another";
}

TEST(ConvertMeasurement, PlacesTheErrorAfterAllThatIsRendered) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_outputs(0)->set_kind(v1::OUTPUT_KIND_ERROR);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_DEPTH);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_ERROR);
  const FrameJob job = MustConvert(request);
  ASSERT_EQ(job.request.images.size(), 2U) << "depth, and the beauty to compare";
  EXPECT_EQ(job.outputs[0].image, 2U);
  EXPECT_EQ(job.outputs[1].image, 0U);
  EXPECT_EQ(job.outputs[2].image, 2U);
  EXPECT_EQ(job.outputs[0].encoding.format, ImageFormat::kExrFloat);
  EXPECT_TRUE(job.measure->map);
  EXPECT_FALSE(job.measure->sample.has_value());
}

TEST(ConvertMeasurement, ComparesAnotherFrameOnlyWhereScatteringShows) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_measure_error();
  v1::Scene& scene = *request.mutable_scene();
  scene.mutable_material()->set_scattering_spread(0.5F);
  EXPECT_TRUE(MustConvert(request).measure->without_scattering);
  // The other blur does not look at the spread, nor light without shadows at either.
  scene.mutable_shadow()->set_blur_mode(v1::BLUR_MODE_TEXELS_PER_SLICE);
  scene.mutable_shadow()->set_blur_texels(1.0F);
  scene.mutable_material()->clear_scattering_spread();
  EXPECT_TRUE(MustConvert(request).measure->without_scattering);
  scene.mutable_lighting()->mutable_lights(0)->set_density(0.0F);
  EXPECT_FALSE(MustConvert(request).measure->without_scattering);
}

TEST(ConvertMeasurement, CountsTheSamplesOfAMeasurementAgainstTheLimit) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->mutable_camera()->set_width(512);
  request.mutable_scene()->mutable_camera()->set_height(512);
  request.mutable_measure_error()->set_samples(131072);
  ServerLimits limits;
  limits.max_reference_work = 2 * 131072;
  MustConvert(request, limits);
  ParticleStore store(1 << 20);
  request.mutable_scene()->mutable_sampling()->set_supersample(2);
  EXPECT_FALSE(ConvertRequest(request, store, limits, {}).ok());
  request.mutable_measure_error()->set_samples(32768);
  MustConvert(request, limits);
  request.add_outputs()->set_kind(v1::OUTPUT_KIND_ERROR);
  EXPECT_FALSE(ConvertRequest(request, store, limits, {}).ok()) << "every pixel of the window";
}

TEST(ConvertMeasurement, AndBackTellsTheErrorAndWhatWasCompared) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_measure_error()->set_seed(7);
  request.mutable_scene()->mutable_material()->set_scattering_spread(0.5F);
  const FrameJob job = MustConvert(request);
  ErrorEstimate error;
  error.covered_pixels = 2000;
  error.sampled_pixels = 1024;
  error.mean_square_error = {4.0, 3.0, 5.0};
  error.bias = {-0.5, -0.75, -0.25};
  error.rmse = {2.0, 1.75, 2.25};
  error.relative_rmse = {0.25, 0.125, 0.5};
  error.reference_mean = 8.0;
  error.sample_p999 = 6.0;
  error.sample_max = 7.0;
  error.sample_worst = {{.pixel = {3, 4}, .error = {7.0, -1.0, 0.5}, .largest = 7.0}};
  error.milliseconds = 12.0;
  MadeFrame frame;
  frame.rendered.images = {FakeImage(job.request.scene, job.request.images[0], 0)};
  frame.error = error;
  const v1::FrameHeader header = DescribeFrame(
      job, frame, {{.bytes = SharedBytes("abc"), .media_type = "image/png", .white_black = {}}},
      DeviceInfo{}, "1");
  const v1::MeasuredError& told = header.error();
  EXPECT_EQ(told.compared(), v1::COMPARED_FRAME_WITHOUT_SCATTERING);
  EXPECT_EQ(told.covered_pixels(), 2000U);
  EXPECT_EQ(told.sampled_pixels(), 1024U);
  EXPECT_EQ(told.measurement().samples(), 1024U);
  EXPECT_EQ(told.measurement().seed(), 7U);
  EXPECT_EQ(told.mean_square_error().value(), 4.0);
  EXPECT_EQ(told.bias().low(), -0.75);
  EXPECT_EQ(told.rmse().high(), 2.25);
  EXPECT_EQ(told.relative_rmse().value(), 0.25);
  EXPECT_EQ(told.reference_mean(), 8.0);
  EXPECT_EQ(told.sample_p999(), 6.0);
  EXPECT_EQ(told.sample_max(), 7.0);
  ASSERT_EQ(told.sample_worst_size(), 1);
  EXPECT_EQ(told.sample_worst(0).x(), 3U);
  EXPECT_EQ(told.sample_worst(0).y(), 4U);
  EXPECT_EQ(told.sample_worst(0).g(), -1.0);
  EXPECT_EQ(told.milliseconds(), 12.0);

  const ImageMetadata metadata = DescribeImage(job, frame, job.outputs[0], {}, "1");
  for (const auto& [name, value] :
       {std::pair("relativeRmse", "0.25"), std::pair("low", "0.125"), std::pair("high", "0.5"),
        std::pair("rmse", "2"), std::pair("mse", "4"), std::pair("bias", "-0.5"),
        std::pair("samples", "1024"), std::pair("coveredPixels", "2000"),
        std::pair("compared", "COMPARED_FRAME_WITHOUT_SCATTERING")}) {
    EXPECT_THAT(metadata.text, ::testing::Contains(std::pair(std::string("halflight:error.") + name,
                                                             std::string(value))));
  }
}

}  // namespace
}  // namespace halflight
