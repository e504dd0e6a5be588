// Every kind of output in every format, from one request, read back by the image library.

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/encode/decoded.h"
#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

constexpr int kWidth = 40;
constexpr int kHeight = 24;
constexpr int kTexels = 32;
constexpr int kSlices = 3;

constexpr std::array kKinds = {v1::OUTPUT_KIND_BEAUTY,       v1::OUTPUT_KIND_COVERAGE,
                               v1::OUTPUT_KIND_DEPTH,        v1::OUTPUT_KIND_LIGHT_TRANSMITTANCE,
                               v1::OUTPUT_KIND_LIGHT_BUFFER, v1::OUTPUT_KIND_LIGHT_LAYERS,
                               v1::OUTPUT_KIND_ERROR};
constexpr std::array kFormats = {v1::IMAGE_FORMAT_PNG8, v1::IMAGE_FORMAT_PNG16,
                                 v1::IMAGE_FORMAT_EXR_HALF, v1::IMAGE_FORMAT_EXR_FLOAT,
                                 v1::IMAGE_FORMAT_RAW_FLOAT};

Scene SmallScene() {
  Scene scene = test::BallScene(200, 32);
  scene.camera = test::LookAt({0, 0, 4}, {0, 0, 0}, kWidth, kHeight);
  scene.shadow.slices = kSlices;
  scene.shadow.light_buffer_size = kTexels;
  return scene;
}

std::vector<float> AllValues(const std::vector<DecodedPart>& parts) {
  std::vector<float> values;
  for (const DecodedPart& part : parts) {
    values.insert(values.end(), part.values.begin(), part.values.end());
  }
  return values;
}

TEST(Outputs, EveryKindInEveryFormatDecodesToItsSize) {
  ServerLimits limits;
  limits.max_outputs = kKinds.size() * kFormats.size();
  const TestServer server(limits);
  client::Client client = server.Connect();
  v1::RenderFrameRequest request = RequestOf(SmallScene());
  request.clear_outputs();
  for (const v1::OutputKind kind : kKinds) {
    for (const v1::ImageFormat format : kFormats) {
      *request.add_outputs() = OutputOf(kind, format);
    }
  }
  const client::RenderedFrame frame = MustRender(client, request);
  ASSERT_EQ(frame.outputs.size(), kKinds.size() * kFormats.size());

  for (size_t i = 0; i < frame.outputs.size(); ++i) {
    const v1::OutputInfo& info = frame.header.outputs(static_cast<int>(i));
    SCOPED_TRACE(info.ShortDebugString());
    const v1::OutputKind kind = request.outputs(static_cast<int>(i)).kind();
    const v1::ImageFormat format = request.outputs(static_cast<int>(i)).format();
    EXPECT_EQ(info.output().kind(), kind);
    EXPECT_EQ(info.output().format(), format);
    const bool of_light =
        kind == v1::OUTPUT_KIND_LIGHT_BUFFER || kind == v1::OUTPUT_KIND_LIGHT_LAYERS;
    const int layers = kind == v1::OUTPUT_KIND_LIGHT_LAYERS ? kSlices : 1;
    const int width = of_light ? kTexels : kWidth;
    const int height = of_light ? kTexels : kHeight;
    const bool colored = kind == v1::OUTPUT_KIND_BEAUTY || kind == v1::OUTPUT_KIND_ERROR;
    const int channels = kind == v1::OUTPUT_KIND_BEAUTY ? 4 : (colored ? 3 : 1);
    EXPECT_EQ(info.width(), static_cast<uint32_t>(width));
    EXPECT_EQ(info.height(), static_cast<uint32_t>(height));
    EXPECT_EQ(info.layers(), static_cast<uint32_t>(layers));
    EXPECT_EQ(info.channels_size(), channels);

    // The raw output of the same kind is the last of its group.
    const std::vector<float> raw =
        FloatsOf(frame.outputs[i / kFormats.size() * kFormats.size() + kFormats.size() - 1]);
    ASSERT_EQ(raw.size(), static_cast<size_t>(width * height * layers * channels));
    if (format == v1::IMAGE_FORMAT_RAW_FLOAT) {
      continue;
    }
    const bool is_png = format == v1::IMAGE_FORMAT_PNG8 || format == v1::IMAGE_FORMAT_PNG16;
    EXPECT_EQ(info.media_type(), is_png ? "image/png" : "image/x-exr");
    const auto parts = Decode(frame.outputs[i], is_png ? "png" : "exr");
    ASSERT_EQ(parts.size(), is_png ? 1U : static_cast<size_t>(layers));
    EXPECT_EQ(parts[0].width, width);
    EXPECT_EQ(parts[0].height, is_png ? height * layers : height);
    const std::vector<float> values = AllValues(parts);
    ASSERT_EQ(values.size(), raw.size());
    if (format == v1::IMAGE_FORMAT_EXR_FLOAT) {
      EXPECT_EQ(values, raw);
    } else if (!colored && kind != v1::OUTPUT_KIND_DEPTH) {
      EXPECT_LT(MaxDifference(values, raw),
                format == v1::IMAGE_FORMAT_PNG8 ? 0.51 / 255 : 0.51 / 1024);
    }
  }
}

TEST(Outputs, EachShowsTheCloudWhereItIs) {
  const TestServer server;
  client::Client client = server.Connect();
  v1::RenderFrameRequest request = RequestOf(SmallScene());
  request.clear_outputs();
  for (const v1::OutputKind kind : kKinds) {
    *request.add_outputs() = OutputOf(kind);
  }
  const client::RenderedFrame frame = MustRender(client, request);
  const auto value = [&](size_t output, size_t x, size_t y, size_t width) {
    return FloatsOf(frame.outputs[output]).at(y * width + x);
  };
  EXPECT_GT(value(1, kWidth / 2, kHeight / 2, kWidth), 0.5);
  EXPECT_EQ(value(1, 0, 0, kWidth), 0.0);
  // A ball of radius 1, 4 away.
  EXPECT_GT(value(2, kWidth / 2, kHeight / 2, kWidth), 3.0);
  EXPECT_LT(value(2, kWidth / 2, kHeight / 2, kWidth), 4.5);
  EXPECT_EQ(value(2, 0, 0, kWidth), INFINITY);
  EXPECT_LT(value(3, kWidth / 2, kHeight / 2, kWidth), 0.95);
  EXPECT_EQ(value(3, 0, 0, kWidth), 1.0);
  EXPECT_LT(value(4, kTexels / 2, kTexels / 2, kTexels), 0.8);

  // Light only ever gets less, and what is left at last is the light buffer.
  const auto layers = FloatsOf(frame.outputs[5]);
  const size_t texels = static_cast<size_t>(kTexels) * kTexels;
  ASSERT_EQ(layers.size(), kSlices * texels);
  for (size_t i = texels; i < layers.size(); ++i) {
    EXPECT_LE(layers[i], layers[i - texels] + 1e-6F);
  }
  EXPECT_EQ(std::vector(layers.end() - static_cast<std::ptrdiff_t>(texels), layers.end()),
            FloatsOf(frame.outputs[4]));
}

// Where the file's own matrix puts a point of the world, in texels.
std::array<double, 2> TexelOf(const glm::dvec3& point, const std::array<float, 16>& matrix,
                              int size) {
  std::array<double, 4> product{};
  const std::array<double, 4> row = {point.x, point.y, point.z, 1.0};
  for (size_t column = 0; column < 4; ++column) {
    for (size_t i = 0; i < 4; ++i) {
      product[column] += row[i] * static_cast<double>(matrix[4 * i + column]);
    }
  }
  return {product[0] / product[3] * size, product[1] / product[3] * size};
}

TEST(Outputs, LightBufferFileTellsWhereAParticleDarkensIt) {
  constexpr int kSize = 256;
  const TestServer server;
  client::Client client = server.Connect();
  Scene scene = SmallScene();
  auto set = std::make_shared<ParticleSet>();
  // Neither symmetric nor in one plane, so that no mirrored or swapped axis goes unseen.
  set->positions = {{-1.0F, 0.2F, 0.3F}, {0.9F, 0.8F, -0.4F}, {0.3F, -0.9F, 0.6F}};
  set->opacities = {0.9F, 0.6F, 0.3F};
  set->origin = {100.0, 0.0, -50.0};
  scene.particles = set;
  scene.material.radius = 0.2F;
  scene.shadow.light_buffer_size = kSize;
  scene.lights = {test::Sun({0.3, -1, -0.5}),
                  {.kind = PointLight{set->origin + glm::dvec3(3, 4, 5)}}};
  v1::RenderFrameRequest request = RequestOf(scene);
  request.clear_outputs();
  for (const uint32_t light : {0U, 1U}) {
    v1::Output& output = *request.add_outputs();
    output = OutputOf(v1::OUTPUT_KIND_LIGHT_BUFFER, v1::IMAGE_FORMAT_EXR_FLOAT);
    output.set_light_index(light);
  }
  const client::RenderedFrame frame = MustRender(client, request);
  for (const std::string& output : frame.outputs) {
    const auto parts = Decode(output, "exr");
    ASSERT_EQ(parts.size(), 1U);
    for (size_t i = 0; i < set->size(); ++i) {
      const auto [x, y] = TexelOf(set->origin + glm::dvec3(set->positions[i]),
                                  parts[0].matrices.at("worldToNDC"), kSize);
      ASSERT_TRUE(x >= 0 && x < kSize && y >= 0 && y < kSize) << x << ", " << y;
      const float light = parts[0].values[static_cast<size_t>(y) * kSize + static_cast<size_t>(x)];
      EXPECT_NEAR(light, 1.0F - set->opacities[i], 0.01) << "particle " << i;
    }
    EXPECT_EQ(parts[0].values[0], 1.0F) << "nothing is in the corner";
  }
}

}  // namespace
}  // namespace halflight::loopback
