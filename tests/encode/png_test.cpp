// What stands in our PNG files, read back by the image library.
#include "server/encode/png.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/encode/srgb.h"
#include "tests/encode/decoded.h"
#include "tests/encode/test_images.h"

namespace halflight {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

double ClosedFormSrgb(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
}

DecodedPart DecodePng(const absl::StatusOr<EncodedImage>& encoded) {
  EXPECT_TRUE(encoded.ok()) << encoded.status();
  std::vector<DecodedPart> parts =
      Decode(encoded.ok() ? std::string(encoded->bytes.view()) : "", "png");
  EXPECT_EQ(parts.size(), 1U);
  return parts.empty() ? DecodedPart{} : parts.front();
}

TEST(SrgbCurve, IsTheClosedFormFromEndToEnd) {
  const SrgbCurve& curve = SrgbCurve::Get();
  double worst = 0.0;
  for (int i = -10; i <= 200'000; ++i) {
    const float linear = static_cast<float>(i) / 190'000.0F;
    worst = std::max(worst, std::abs(curve(linear) - ClosedFormSrgb(linear)));
  }
  EXPECT_LT(worst, 1.5e-7);  // the float's own last place included
  EXPECT_EQ(curve(std::numeric_limits<float>::quiet_NaN()), 0.0F);
  EXPECT_EQ(curve(kInfinity), 1.0F);
}

TEST(Png, BeautyIsUnassociatedSrgbRoundedToNearest) {
  const Image image = MakeBeauty(64, 48);
  for (const ImageFormat format : {ImageFormat::kPng8, ImageFormat::kPng16}) {
    const double steps = format == ImageFormat::kPng8 ? 255.0 : 65535.0;
    const DecodedPart png = DecodePng(Encode(image, ImageKind::kBeauty, format));
    ASSERT_EQ(png.width, 64);
    ASSERT_EQ(png.height, 48);
    ASSERT_EQ(png.channels.size(), 4U);
    EXPECT_EQ(png.texts.at("oiio:ColorSpace"), "sRGB");
    double worst = 0.0;
    for (size_t i = 0; i < image.pixels.size(); ++i) {
      const double alpha = image.pixels[i | 3U];
      const bool is_alpha = (i & 3U) == 3U;
      double expected = is_alpha ? alpha : 0.0;
      if (!is_alpha && alpha > 0.0) expected = ClosedFormSrgb(image.pixels[i] / alpha);
      worst = std::max(worst, std::abs(png.codes[i] / 65535.0 - expected) * steps);
    }
    EXPECT_LT(worst, 0.51) << steps;  // truncation would give nearly 1
  }
}

TEST(Png, AlphaZeroLosesEmissionAndStoresZero) {
  const Image image = MakeImage(2, 1, {"R", "G", "B", "A"}, {3, 2, 1, 0, 0.25, 0.25, 0.25, 0.25});
  const DecodedPart png = DecodePng(Encode(image, ImageKind::kBeauty, ImageFormat::kPng8));
  EXPECT_THAT(png.codes, testing::ElementsAre(0, 0, 0, 0, 65535, 65535, 65535, 64 * 257));
}

TEST(Png, RowZeroIsTheTop) {
  const Image image = MakeImage(1, 3, {"A"}, {1.0F, 0.5F, 0.0F});
  const DecodedPart png = DecodePng(Encode(image, ImageKind::kCoverage, ImageFormat::kPng16));
  EXPECT_THAT(png.codes, testing::ElementsAre(65535, 32768, 0));
}

TEST(Png, LightIsLinearGreyOrRgb) {
  const DecodedPart grey = DecodePng(
      Encode(MakeImage(2, 1, {"Y"}, {0.2F, 1.5F}), ImageKind::kLightBuffer, ImageFormat::kPng8));
  EXPECT_EQ(grey.channels.size(), 1U);
  EXPECT_EQ(grey.texts.at("oiio:ColorSpace"), "Linear");
  EXPECT_THAT(grey.codes, testing::ElementsAre(51 * 257, 255 * 257));
  const DecodedPart rgb = DecodePng(Encode(MakeImage(1, 1, {"R", "G", "B"}, {0.2F, 0.4F, 0.6F}),
                                           ImageKind::kLightTransmittance, ImageFormat::kPng8));
  EXPECT_THAT(rgb.codes, testing::ElementsAre(51 * 257, 102 * 257, 153 * 257));
}

TEST(Png, DepthIsWhiteWhereNearestAndBlackWhereFarthestOrEmpty) {
  const Image image = MakeImage(4, 1, {"Z"}, {2.0F, 3.0F, 6.0F, kInfinity});
  const auto encoded = Encode(image, ImageKind::kDepth, ImageFormat::kPng16);
  const DecodedPart png = DecodePng(encoded);
  EXPECT_THAT(png.codes, testing::ElementsAre(65535, 49151, 0, 0));
  ASSERT_TRUE(encoded->white_black.has_value());
  EXPECT_EQ(encoded->white_black->first, 2.0);
  EXPECT_EQ(encoded->white_black->second, 6.0);
  EXPECT_EQ(png.texts.at("halflight:white_value"), "2");
  EXPECT_EQ(png.texts.at("halflight:black_value"), "6");
}

TEST(Png, DepthOfOneValueIsWhiteAndOfNoneIsBlack) {
  const auto one =
      Encode(MakeImage(2, 1, {"Z"}, {5.0F, kInfinity}), ImageKind::kDepth, ImageFormat::kPng8);
  EXPECT_THAT(DecodePng(one).values, testing::ElementsAre(1, 0));
  EXPECT_EQ(one->white_black->first, one->white_black->second);
  const auto none =
      Encode(MakeImage(2, 1, {"Z"}, {kInfinity, kInfinity}), ImageKind::kDepth, ImageFormat::kPng8);
  EXPECT_THAT(DecodePng(none).values, testing::ElementsAre(0, 0));
  EXPECT_FALSE(none->white_black.has_value());
}

TEST(Png, OpticalDepthIsScaledOverAllLayersWhichLieBelowEachOther) {
  const Image image = MakeImage(2, 1, {"Y"}, {0.0F, 1.0F, 2.0F, 4.0F, 8.0F, 0.0F}, 3);
  const auto encoded =
      Encode(image, ImageKind::kLightLayers, ImageFormat::kPng8, LightQuantity::kOpticalDepth);
  const DecodedPart png = DecodePng(encoded);
  EXPECT_EQ(png.width, 2);
  EXPECT_EQ(png.height, 3);
  EXPECT_THAT(png.codes, testing::ElementsAre(0, 32 * 257, 64 * 257, 128 * 257, 65535, 0));
  EXPECT_EQ(encoded->white_black, std::make_pair(8.0, 0.0));
}

TEST(Png, EmptyOpticalDepthIsBlack) {
  const auto encoded = Encode(MakeImage(2, 1, {"Y"}, {0.0F, 0.0F}), ImageKind::kLightBuffer,
                              ImageFormat::kPng8, LightQuantity::kOpticalDepth);
  EXPECT_THAT(DecodePng(encoded).values, testing::ElementsAre(0, 0));
}

TEST(Png, ErrorsAreWhiteWhereTheyAreLargestWhateverTheirSign) {
  const auto encoded = Encode(MakeImage(2, 1, {"R", "G", "B"}, {0.0F, -0.5F, 0.25F, 0.125F, 0, 0}),
                              ImageKind::kError, ImageFormat::kPng8);
  const DecodedPart png = DecodePng(encoded);
  EXPECT_THAT(png.codes, testing::ElementsAre(0, 65535, 128 * 257, 64 * 257, 0, 0));
  EXPECT_EQ(encoded->white_black, std::make_pair(0.5, 0.0));
  EXPECT_EQ(png.texts.at("halflight:white_value"), "0.5");
}

TEST(Png, NoErrorIsBlackAndAnInfiniteOneWhite) {
  const auto none = Encode(MakeImage(1, 1, {"R", "G", "B"}, {0.0F, 0.0F, 0.0F}), ImageKind::kError,
                           ImageFormat::kPng8);
  EXPECT_THAT(DecodePng(none).codes, testing::ElementsAre(0, 0, 0));
  const auto infinite = Encode(MakeImage(1, 1, {"R", "G", "B"}, {-kInfinity, 0.5F, 1.0F}),
                               ImageKind::kError, ImageFormat::kPng8);
  EXPECT_THAT(DecodePng(infinite).codes, testing::ElementsAre(65535, 128 * 257, 65535));
}

TEST(Png, TransmittanceIsNotScaled) {
  const auto encoded =
      Encode(MakeImage(1, 1, {"Y"}, {0.4F}), ImageKind::kLightBuffer, ImageFormat::kPng8);
  EXPECT_FALSE(encoded->white_black.has_value());
  EXPECT_THAT(DecodePng(encoded).codes, testing::ElementsAre(102 * 257));
}

TEST(Png, CarriesTextAndNoTime) {
  ImageMetadata metadata;
  metadata.text = {{"halflight:technique", "half_angle"}, {"halflight:slices", "128"}};
  const auto encoded = Encode(MakeBeauty(4, 4), ImageKind::kBeauty, ImageFormat::kPng8,
                              LightQuantity::kTransmittance, metadata);
  const DecodedPart png = DecodePng(encoded);
  EXPECT_EQ(png.texts.at("halflight:technique"), "half_angle");
  EXPECT_EQ(png.texts.at("halflight:slices"), "128");
  EXPECT_EQ(encoded->bytes.view().find("tIME"), std::string::npos);
  EXPECT_STREQ(encoded->media_type, "image/png");
}

TEST(Png, NamesTheLimitOnRows) {
  const Image image = MakeImage(1, 1000, {"Y"}, std::vector<float>(1'001'000), 1001);
  const auto encoded = Encode(image, ImageKind::kLightLayers, ImageFormat::kPng8);
  EXPECT_EQ(encoded.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(encoded.status().message(), testing::HasSubstr("1000000 rows"));
}

}  // namespace
}  // namespace halflight
