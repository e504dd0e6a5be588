// What is said of a frame's error, to people and to machines.
#include "client/cli/report.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>

namespace halflight::client {
namespace {

using testing::HasSubstr;
using testing::Not;

RenderedFrame MeasuredFrame() {
  RenderedFrame frame;
  v1::MeasuredError& error = *frame.header.mutable_error();
  error.set_compared(v1::COMPARED_FRAME_RETURNED);
  error.set_covered_pixels(74116);
  error.set_sampled_pixels(1024);
  error.mutable_relative_rmse()->set_value(0.1189);
  error.mutable_relative_rmse()->set_low(0.1054);
  error.mutable_relative_rmse()->set_high(0.1341);
  error.mutable_bias()->set_value(0.00623);
  error.mutable_bias()->set_low(-0.00433);
  error.mutable_bias()->set_high(0.00813);
  error.set_reference_mean(0.314);
  v1::PixelError& worst = *error.add_sample_worst();
  worst.set_x(232);
  worst.set_y(66);
  worst.set_r(-0.32);
  worst.set_g(0.25);
  worst.set_b(-0.125);
  return frame;
}

TEST(FrameText, TellsTheErrorItsIntervalAndTheWorstPixel) {
  const std::string text = FrameText({}, MeasuredFrame());
  EXPECT_THAT(text,
              HasSubstr("error: relative RMSE 11.9 % (10.5 % to 13.4 % with 95 % confidence), "
                        "bias +0.00623 (-0.00433 to +0.00813), from 1024 of 74116 covered "
                        "pixels\n"));
  EXPECT_THAT(text, HasSubstr("x 232, y 66, where R G B are off by -0.32 +0.25 -0.125"));
  EXPECT_THAT(text, HasSubstr("mean is 0.314\n"));
  EXPECT_THAT(text, Not(HasSubstr("scattering")));
}

TEST(FrameText, SaysWhenAnotherFrameWasCompared) {
  RenderedFrame frame = MeasuredFrame();
  frame.header.mutable_error()->set_compared(v1::COMPARED_FRAME_WITHOUT_SCATTERING);
  EXPECT_THAT(FrameText({}, frame), HasSubstr("without scattering, which the image model has not"));
}

TEST(FrameText, LeavesOutIntervalsWhereNothingWasLeftToChance) {
  RenderedFrame frame = MeasuredFrame();
  frame.header.mutable_error()->set_sampled_pixels(74116);
  const std::string text = FrameText({}, frame);
  EXPECT_THAT(text, HasSubstr("relative RMSE 11.9 %, bias +0.00623, at all 74116 covered pixels"));
  EXPECT_THAT(text, Not(HasSubstr("confidence")));
}

TEST(FrameText, OfAnEmptyFrameSaysThatThereIsNothingToMeasure) {
  RenderedFrame frame;
  EXPECT_THAT(FrameText({}, frame), Not(HasSubstr("error")));
  frame.header.mutable_error();
  EXPECT_THAT(FrameText({}, frame), HasSubstr("error: none to measure, since no pixel is covered"));
}

RenderedFrame TargetFrame() {
  RenderedFrame frame;
  v1::TargetOutcome& outcome = *frame.header.mutable_target();
  outcome.mutable_target()->set_max_error(0.05);
  outcome.set_met(true);
  outcome.add_attempts();
  v1::TargetAttempt& attempt = *outcome.add_attempts();
  attempt.mutable_shadow()->set_technique(v1::SHADOW_TECHNIQUE_HALF_ANGLE);
  attempt.mutable_shadow()->set_slices(256);
  attempt.mutable_shadow()->set_light_buffer_size(512);
  attempt.mutable_relative_rmse()->set_value(0.043);
  attempt.mutable_relative_rmse()->set_low(0.0402);
  attempt.mutable_relative_rmse()->set_high(0.046);
  attempt.set_milliseconds(212);
  attempt.set_met(true);
  attempt.set_returned(true);
  v1::StageTiming& search = *frame.header.add_timings();
  search.set_stage("search");
  search.set_milliseconds(812);
  return frame;
}

TEST(FrameText, TellsWhatMetTheTargetAndWhatItTook) {
  RenderedFrame frame = TargetFrame();
  EXPECT_THAT(FrameText({}, frame),
              HasSubstr("target: met: error 4.3 % (4.02 % to 4.6 %) of 5 % asked: half-angle, 256 "
                        "slices, light buffer 512; 2 frames tried in 812 ms\n"));
  v1::TargetOutcome& outcome = *frame.header.mutable_target();
  outcome.mutable_target()->set_max_time_ms(100);
  outcome.set_met(false);
  outcome.set_reason("all others are slower");
  EXPECT_THAT(FrameText({}, frame), HasSubstr("target: NOT MET: error 4.3 % (4.02 % to 4.6 %) of "
                                              "5 % asked, 212 ms of 100 ms asked: half-angle"));
  EXPECT_EQ(TargetMissText(outcome),
            "error 4.3 % (4.02 % to 4.6 %) of 5 % asked, 212 ms of 100 ms asked: all others are "
            "slower");
}

TEST(FrameJson, HasTheErrorAsTheServerTellsIt) {
  const RenderedFrame frame = MeasuredFrame();
  const std::string json = FrameJson({}, frame, {}, {});
  const size_t begin = json.find("\"error\":");
  ASSERT_NE(begin, std::string::npos);
  v1::MeasuredError error;
  const std::string message = json.substr(begin + 8, json.size() - begin - 9);
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(message, &error).ok()) << message;
  EXPECT_EQ(error.SerializeAsString(), frame.header.error().SerializeAsString());
  EXPECT_THAT(FrameJson({}, {}, {}, {}), Not(HasSubstr("\"error\"")));
}

}  // namespace
}  // namespace halflight::client
