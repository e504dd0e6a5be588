// What stands in our OpenEXR files, read back by the image library, and byte by byte where that
// library would rename it.
#include "server/encode/exr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/vec2.hpp>

#include "tests/encode/decoded.h"
#include "tests/encode/test_images.h"

namespace halflight {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::vector<DecodedPart> DecodeExr(const absl::StatusOr<EncodedImage>& encoded) {
  EXPECT_TRUE(encoded.ok()) << encoded.status();
  return Decode(encoded.ok() ? std::string(encoded->bytes.view()) : "", "exr");
}

// OpenEXR's own rule: a row vector from the left.
glm::dvec4 RowTimesMatrix(const glm::dvec4& row, const std::array<float, 16>& matrix) {
  glm::dvec4 product(0.0);
  for (int column = 0; column < 4; ++column) {
    for (int i = 0; i < 4; ++i) {
      product[column] +=
          row[i] *
          static_cast<double>(matrix[4U * static_cast<size_t>(i) + static_cast<size_t>(column)]);
    }
  }
  return product;
}

// The header's field as it stands in the file: name, zero, type, zero.
bool HasField(std::string_view bytes, const std::string& name, const std::string& type) {
  return bytes.find(name + '\0' + type + '\0') != std::string::npos;
}

// A camera at (1, 2, 3) that looks along world -x, so world -z is to its right.
ImageMetadata SidewaysCamera() {
  const glm::dmat4 camera_from_world =
      glm::lookAt(glm::dvec3(1, 2, 3), glm::dvec3(0, 2, 3), glm::dvec3(0, 1, 0));
  const glm::dmat4 clip_from_camera = glm::perspective(glm::radians(90.0), 2.0, 0.1, 100.0);
  const glm::dmat4 ndc_from_clip = glm::translate(glm::dmat4(1.0), glm::dvec3(0.5, 0.5, 0.0)) *
                                   glm::scale(glm::dmat4(1.0), glm::dvec3(0.5, -0.5, 1.0));
  ImageMetadata metadata;
  metadata.world_to_camera = camera_from_world;
  metadata.world_to_ndc = ndc_from_clip * clip_from_camera * camera_from_world;
  return metadata;
}

TEST(Exr, FloatKeepsEveryValueAndTheNamesOfChannels) {
  const Image image = MakeBeauty(31, 17);
  const auto parts = DecodeExr(Encode(image, ImageKind::kBeauty, ImageFormat::kExrFloat));
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].values, image.pixels);
  EXPECT_THAT(parts[0].channels, testing::ElementsAre("R", "G", "B", "A"));
  EXPECT_EQ(parts[0].sample_type, "float");
}

TEST(Exr, ErrorsKeepTheirSign) {
  const Image image = MakeImage(2, 1, {"R", "G", "B"}, {-0.5F, 1e-9F, 2.0F, 0.0F, -3e-8F, 0.1F});
  const auto parts = DecodeExr(Encode(image, ImageKind::kError, ImageFormat::kExrFloat));
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].values, image.pixels);
  EXPECT_THAT(parts[0].channels, testing::ElementsAre("R", "G", "B"));
}

TEST(Exr, HalfRoundsToNearest) {
  const Image image = MakeBeauty(31, 17);
  const auto parts = DecodeExr(Encode(image, ImageKind::kBeauty, ImageFormat::kExrHalf));
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].sample_type, "half");
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const float allowed = std::max(std::abs(image.pixels[i]) * 0x1p-11F, 0x1p-25F);
    EXPECT_NEAR(parts[0].values[i], image.pixels[i], allowed);
  }
}

TEST(Exr, SingleChannelsAreNamedAsInTheImage) {
  const std::array<std::pair<ImageKind, const char*>, 3> kinds{
      {{ImageKind::kCoverage, "A"}, {ImageKind::kDepth, "Z"}, {ImageKind::kLightBuffer, "Y"}}};
  for (const auto& [kind, channel] : kinds) {
    const auto parts =
        DecodeExr(Encode(MakeImage(1, 2, {channel}, {0.25F, 0.5F}), kind, ImageFormat::kExrHalf));
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_THAT(parts[0].channels, testing::ElementsAre(channel));
    EXPECT_THAT(parts[0].values, testing::ElementsAre(0.25F, 0.5F));
  }
}

TEST(Exr, InfiniteDepthSurvivesEveryCompression) {
  const Image image = MakeImage(3, 2, {"Z"}, {1.0F, kInfinity, 2.0F, kInfinity, 3.5F, 65504.0F});
  for (const ImageFormat format : {ImageFormat::kExrHalf, ImageFormat::kExrFloat}) {
    for (int compression = 0; compression <= static_cast<int>(ExrCompression::kDwab);
         ++compression) {
      const auto encoded = EncodeImage(
          std::make_shared<const Image>(image), ImageKind::kDepth, LightQuantity::kTransmittance,
          {.format = format, .compression = static_cast<ExrCompression>(compression)}, {});
      const auto parts = DecodeExr(encoded);
      ASSERT_EQ(parts.size(), 1U);
      EXPECT_EQ(parts[0].values, image.pixels) << compression;
    }
  }
}

TEST(Exr, EveryCompressionIsTheOneAskedFor) {
  const std::array names{"none", "rle", "zips", "zip", "piz", "dwaa", "dwab"};
  const Image image = MakeBeauty(40, 40);
  constexpr size_t kSample = (20 * 40 + 20) * 4 + 1;
  for (size_t i = 0; i < names.size(); ++i) {
    const auto parts = DecodeExr(EncodeImage(
        std::make_shared<const Image>(image), ImageKind::kBeauty, LightQuantity::kTransmittance,
        {.format = ImageFormat::kExrHalf, .compression = static_cast<ExrCompression>(i)}, {}));
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_EQ(parts[0].texts.at("compression"), names[i]);
    EXPECT_NEAR(parts[0].values[kSample], image.pixels[kSample], 0.01F) << names[i];
  }
}

TEST(Exr, SingleChannelsAreNeverLossy) {
  for (const ExrCompression compression : {ExrCompression::kDwaa, ExrCompression::kDwab}) {
    const auto parts =
        DecodeExr(EncodeImage(std::make_shared<const Image>(MakeImage(1, 1, {"Y"}, {0.3F})),
                              ImageKind::kLightBuffer, LightQuantity::kTransmittance,
                              {.format = ImageFormat::kExrFloat, .compression = compression}, {}));
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_EQ(parts[0].texts.at("compression"), "zip");
    EXPECT_THAT(parts[0].values, testing::ElementsAre(0.3F));
  }
}

TEST(Exr, WritesStandardAttributesUnderTheirNamesAndTypes) {
  ImageMetadata metadata = SidewaysCamera();
  metadata.text = {{"halflight:technique", "half_angle"}};
  const auto eye = Encode(MakeBeauty(4, 2), ImageKind::kBeauty, ImageFormat::kExrHalf,
                          LightQuantity::kTransmittance, metadata);
  ASSERT_TRUE(eye.ok()) << eye.status();
  EXPECT_STREQ(eye->media_type, "image/x-exr");
  EXPECT_TRUE(HasField(eye->bytes.view(), "worldToCamera", "m44f"));
  EXPECT_TRUE(HasField(eye->bytes.view(), "worldToNDC", "m44f"));
  EXPECT_TRUE(HasField(eye->bytes.view(), "chromaticities", "chromaticities"));
  EXPECT_TRUE(HasField(eye->bytes.view(), "halflight:technique", "string"));
  EXPECT_FALSE(HasField(eye->bytes.view(), "halflight:worldToLightTexture", "m44f"));
  const auto light = Encode(MakeImage(1, 1, {"Y"}, {1.0F}), ImageKind::kLightBuffer,
                            ImageFormat::kExrHalf, LightQuantity::kTransmittance, metadata);
  ASSERT_TRUE(light.ok()) << light.status();
  EXPECT_TRUE(HasField(light->bytes.view(), "halflight:worldToLightTexture", "m44f"));
}

TEST(Exr, MatricesTakeAWorldPointToItsPixelAsRowVectors) {
  const auto parts = DecodeExr(Encode(MakeBeauty(4, 2), ImageKind::kBeauty, ImageFormat::kExrFloat,
                                      LightQuantity::kTransmittance, SidewaysCamera()));
  ASSERT_EQ(parts.size(), 1U);
  // Two in front of the camera, half a unit up and a unit to its right.
  const glm::dvec4 point(-1.0, 2.5, 2.0, 1.0);
  const glm::dvec4 camera = RowTimesMatrix(point, parts[0].matrices.at("worldToCamera"));
  EXPECT_NEAR(camera.x, 1.0, 1e-6);
  EXPECT_NEAR(camera.y, 0.5, 1e-6);
  EXPECT_NEAR(camera.z, 2.0, 1e-6);  // in front is positive
  const glm::dvec4 ndc = RowTimesMatrix(point, parts[0].matrices.at("worldToNDC"));
  // 90 degrees high and twice as wide: at distance 2 the picture spans 8 by 4 units.
  EXPECT_NEAR(ndc.x / ndc.w, 0.5 + 1.0 / 8.0, 1e-6);
  EXPECT_NEAR(ndc.y / ndc.w, 0.5 - 0.5 / 4.0, 1e-6);
}

TEST(Exr, LightBuffersNameTheirTextureMatrix) {
  const ImageMetadata metadata = SidewaysCamera();
  const auto parts =
      DecodeExr(Encode(MakeImage(1, 1, {"Y"}, {1.0F}, 1), ImageKind::kLightLayers,
                       ImageFormat::kExrHalf, LightQuantity::kOpticalDepth, metadata));
  ASSERT_EQ(parts.size(), 1U);
  const auto texture = parts[0].matrices.at("halflight:worldToLightTexture");
  EXPECT_NE(texture, (std::array<float, 16>{}));
  EXPECT_EQ(texture, parts[0].matrices.at("worldToNDC"));
  const glm::dvec4 point(-1.0, 2.5, 2.0, 1.0);
  const glm::dvec4 expected = *metadata.world_to_ndc * point;
  const glm::dvec4 read = RowTimesMatrix(point, texture);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(read[i], expected[i], 1e-6);
}

TEST(Exr, CropsKeepTheirPlaceInTheWholeImage) {
  ImageMetadata metadata;
  metadata.data_window = {5, 7, 3, 2};
  metadata.display_size = {40, 30};
  const Image image = MakeBeauty(3, 2);
  const auto parts = DecodeExr(Encode(image, ImageKind::kBeauty, ImageFormat::kExrFloat,
                                      LightQuantity::kTransmittance, metadata));
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_THAT(parts[0].offset, testing::ElementsAre(5, 7));
  EXPECT_THAT(parts[0].whole_window, testing::ElementsAre(0, 0, 40, 30));
  EXPECT_EQ(parts[0].values, image.pixels);
}

TEST(Exr, LayersAreNamedPartsInOrder) {
  Image image = MakeImage(3, 2, {"R", "G", "B"}, {}, 12);
  for (size_t i = 0; i < size_t{12} * 18; ++i) image.pixels.push_back(static_cast<float>(i) / 8.0F);
  ImageMetadata metadata = SidewaysCamera();
  metadata.text = {{"halflight:technique", "half_angle"}};
  for (const ImageFormat format : {ImageFormat::kExrHalf, ImageFormat::kExrFloat}) {
    const auto parts = DecodeExr(
        Encode(image, ImageKind::kLightLayers, format, LightQuantity::kOpticalDepth, metadata));
    ASSERT_EQ(parts.size(), 12U);
    EXPECT_FALSE(std::filesystem::exists("memory.exr"));  // nothing is left on disk
    EXPECT_EQ(parts[0].texts.at("oiio:subimagename"), "layer.0000");
    EXPECT_EQ(parts[11].texts.at("oiio:subimagename"), "layer.0011");
    for (size_t layer = 0; layer < 12; ++layer) {
      const auto first = image.pixels.begin() + static_cast<std::ptrdiff_t>(layer * 18);
      EXPECT_EQ(parts[layer].values, std::vector<float>(first, first + 18));
      EXPECT_EQ(parts[layer].texts.at("halflight:technique"), "half_angle");
      EXPECT_NE(parts[layer].matrices.at("worldToNDC"), (std::array<float, 16>{}));
    }
  }
}

TEST(Exr, HalfRefusesFiniteValuesItWouldMakeInfinite) {
  const auto encoded =
      Encode(MakeImage(1, 1, {"Z"}, {70'000.0F}), ImageKind::kDepth, ImageFormat::kExrHalf);
  EXPECT_EQ(encoded.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(encoded.status().message(), testing::HasSubstr("EXR_FLOAT"));
}

}  // namespace
}  // namespace halflight
