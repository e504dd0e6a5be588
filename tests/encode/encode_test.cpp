// What holds for every format: equal bytes for equal requests, and clear refusals.
#include "server/encode/encode.h"

#include <array>
#include <chrono>
#include <cstring>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <OpenImageIO/ustring.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/encode/test_images.h"

namespace halflight {
namespace {

constexpr std::array kEveryFormat{ImageFormat::kPng8, ImageFormat::kPng16, ImageFormat::kExrHalf,
                                  ImageFormat::kExrFloat, ImageFormat::kRawFloat};

ImageMetadata SomeMetadata() {
  ImageMetadata metadata;
  metadata.world_to_camera = glm::dmat4(2.0);
  metadata.world_to_ndc = glm::dmat4(3.0);
  metadata.text = {{"halflight:technique", "half_angle"}};
  return metadata;
}

// The message of the refusal; empty where the image was encoded.
std::string Refusal(const Image& image, ImageKind kind, const ImageMetadata& metadata = {}) {
  const auto encoded =
      Encode(image, kind, ImageFormat::kPng8, LightQuantity::kTransmittance, metadata);
  if (encoded.ok()) return "";
  EXPECT_EQ(encoded.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string{encoded.status().message()};
}

TEST(EncodeImage, IsCutShortOnceNobodyWantsTheFile) {
  std::stop_source stop;
  const auto beauty = std::make_shared<const Image>(MakeBeauty(200, 300));
  const auto code = [&](ImageFormat format) {
    return EncodeImage(beauty, ImageKind::kBeauty, LightQuantity::kTransmittance,
                       {.format = format, .stop = stop.get_token()}, {})
        .status()
        .code();
  };
  EXPECT_EQ(code(ImageFormat::kPng8), absl::StatusCode::kOk);
  stop.request_stop();
  for (const ImageFormat format :
       {ImageFormat::kPng8, ImageFormat::kPng16, ImageFormat::kExrHalf, ImageFormat::kExrFloat}) {
    EXPECT_EQ(code(format), absl::StatusCode::kCancelled) << static_cast<int>(format);
  }
}

TEST(EncodeImage, GivesTheSameBytesASecondLaterAndOnOtherThreads) {
  const Image beauty = MakeBeauty(100, 70);
  Image layers = MakeImage(20, 20, {"Y"}, {}, 9);
  for (size_t i = 0; i < size_t{9} * 400; ++i)
    layers.pixels.push_back(static_cast<float>(i % 37) / 36.F);
  const auto encode_all = [&](std::vector<std::string>& files) {
    for (const ImageFormat format : kEveryFormat) {
      for (const auto& encoded : {Encode(beauty, ImageKind::kBeauty, format,
                                         LightQuantity::kTransmittance, SomeMetadata()),
                                  Encode(layers, ImageKind::kLightLayers, format,
                                         LightQuantity::kOpticalDepth, SomeMetadata())}) {
        files.push_back(encoded.ok() ? std::string(encoded->bytes.view())
                                     : encoded.status().ToString());
      }
    }
  };
  std::vector<std::string> expected;
  encode_all(expected);
  // Dates in files have a resolution of a second.
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  std::array<std::vector<std::string>, 4> found;
  std::vector<std::thread> threads;
  threads.reserve(found.size());
  for (auto& files : found) threads.emplace_back([&] { encode_all(files); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& files : found) EXPECT_TRUE(files == expected);
}

TEST(EncodeImage, RawIsThePixelsThemselves) {
  auto image = std::make_shared<const Image>(MakeBeauty(5, 3));
  const Image copy = *image;
  const auto encoded = EncodeImage(image, ImageKind::kBeauty, LightQuantity::kTransmittance,
                                   {.format = ImageFormat::kRawFloat}, {});
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  const std::string_view bytes = encoded->bytes.view();
  ASSERT_EQ(bytes.size(), copy.pixels.size() * sizeof(float));
  EXPECT_EQ(static_cast<const void*>(bytes.data()), image->pixels.data()) << "copied";
  image.reset();
  EXPECT_EQ(std::memcmp(bytes.data(), copy.pixels.data(), bytes.size()), 0);
  EXPECT_STREQ(encoded->media_type, "application/octet-stream");
}

TEST(EncodeImage, RefusesChannelsThatAreNotTheKinds) {
  EXPECT_THAT(Refusal(MakeImage(1, 1, {"R", "G", "B"}, {0, 0, 0}), ImageKind::kBeauty),
              testing::HasSubstr("R,G,B; allowed for this kind: R,G,B,A"));
  EXPECT_THAT(Refusal(MakeImage(1, 1, {"A"}, {0}), ImageKind::kLightBuffer),
              testing::HasSubstr("Y or R,G,B"));
  EXPECT_THAT(Refusal(MakeImage(1, 1, {"Y"}, {0}), ImageKind::kDepth), testing::HasSubstr("Z"));
}

TEST(EncodeImage, RefusesSizesThatDoNotFit) {
  EXPECT_THAT(Refusal(MakeImage(2, 2, {"A"}, {0, 0, 0}), ImageKind::kCoverage),
              testing::HasSubstr("3 values; its size calls for 4"));
  EXPECT_THAT(Refusal(MakeImage(0, 2, {"A"}, {}), ImageKind::kCoverage),
              testing::HasSubstr("0 x 2"));
  EXPECT_THAT(Refusal(MakeImage(1, 1, {"A"}, {}, 0), ImageKind::kCoverage),
              testing::HasSubstr("0 layers"));
}

TEST(EncodeImage, RefusesACropOutsideTheWholeImage) {
  const Image image = MakeImage(2, 1, {"A"}, {0, 0});
  ImageMetadata metadata;
  metadata.display_size = {10, 10};
  metadata.data_window = {9, 0, 2, 1};
  EXPECT_THAT(Refusal(image, ImageKind::kCoverage, metadata),
              testing::HasSubstr("2 x 1 at (9, 0)"));
  metadata.data_window = {0, 0, 3, 1};
  EXPECT_THAT(Refusal(image, ImageKind::kCoverage, metadata), testing::HasSubstr("data_window"));
  metadata.data_window = {8, 9, 2, 1};
  EXPECT_EQ(Refusal(image, ImageKind::kCoverage, metadata), "");
}

// A server writes for months, and what it writes of particles and errors is new each time.
TEST(EncodeImage, KeepsNothingOfWhatFilesSay) {
  const Image beauty = MakeBeauty(4, 3);
  Image depth = MakeImage(2, 1, {"Z"}, {});
  Image layers = MakeImage(2, 2, {"Y"}, std::vector<float>(size_t{9} * 4, 0.5F), 9);
  const std::vector<std::pair<const Image*, ImageKind>> images = {
      {&beauty, ImageKind::kBeauty},
      {&depth, ImageKind::kDepth},
      {&layers, ImageKind::kLightLayers}};
  const auto encode_all = [&](int frame) {
    ImageMetadata metadata = SomeMetadata();
    metadata.text.emplace_back("halflight:particles", std::string(40, 'a') + std::to_string(frame));
    depth.pixels = {1.0F, 2.0F + static_cast<float>(frame)};
    for (const ImageFormat format : kEveryFormat) {
      for (const auto& [image, kind] : images) {
        EXPECT_TRUE(Encode(*image, kind, format, LightQuantity::kTransmittance, metadata).ok());
      }
    }
  };
  encode_all(0);
  const size_t kept = OIIO::ustring::total_ustrings();
  for (int frame = 1; frame <= 20; ++frame) {
    encode_all(frame);
  }
  EXPECT_EQ(OIIO::ustring::total_ustrings(), kept);
}

TEST(EncodeImage, RefusesTextThatHeadersCannotHold) {
  const Image image = MakeImage(1, 1, {"A"}, {0});
  ImageMetadata metadata;
  metadata.text = {{"", "value"}};
  EXPECT_THAT(Refusal(image, ImageKind::kCoverage, metadata), testing::HasSubstr("metadata.text"));
  metadata.text = {{std::string(80, 'n'), "value"}};
  EXPECT_THAT(Refusal(image, ImageKind::kCoverage, metadata), testing::HasSubstr("1 to 79"));
  metadata.text = {{"name", std::string("a\0b", 3)}};
  EXPECT_THAT(Refusal(image, ImageKind::kCoverage, metadata), testing::HasSubstr("zero byte"));
}

}  // namespace
}  // namespace halflight
