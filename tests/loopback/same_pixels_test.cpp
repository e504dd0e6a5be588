// The wire changes nothing: the same bytes again, over any transport, and as the renderer made
// them.

#include <future>

#include <gtest/gtest.h>

#include "renderer/frame_renderer.h"
#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/oracle/oracle.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

v1::RenderFrameRequest InThreeFormats(const Scene& scene) {
  v1::RenderFrameRequest request = RequestOf(scene);
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY, v1::IMAGE_FORMAT_PNG8);
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY, v1::IMAGE_FORMAT_EXR_HALF);
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_LIGHT_BUFFER, v1::IMAGE_FORMAT_EXR_FLOAT);
  return request;
}

TEST(SamePixels, RequestTwiceGivesTheSameBytesOverAnyTransport) {
  const TestServer server;
  const v1::RenderFrameRequest request = InThreeFormats(test::BallScene(500, 48));
  client::Client tcp = server.Connect();
  const client::RenderedFrame first = MustRender(tcp, request);
  // A frame of another kind in between leaves nothing behind.
  Scene other = test::BallScene(90, 20);
  other.camera.projection = Orthographic{3.0};
  MustRender(tcp, RequestOf(other, v1::OUTPUT_KIND_DEPTH));
  EXPECT_EQ(MustRender(tcp, request).outputs, first.outputs);

  auto local = client::Client::Connect(server.unix_address());
  ASSERT_TRUE(local.ok()) << local.status();
  EXPECT_EQ(MustRender(*local, request).outputs, first.outputs);
}

TEST(SamePixels, SizesAreThoseOfTheBytes) {
  const TestServer server;
  client::Client client = server.Connect();
  const client::RenderedFrame frame = MustRender(client, InThreeFormats(test::BallScene(100, 200)));
  ASSERT_EQ(frame.outputs.size(), 4U);
  for (size_t i = 0; i < frame.outputs.size(); ++i) {
    EXPECT_EQ(frame.header.outputs(static_cast<int>(i)).byte_size(), frame.outputs[i].size());
  }
}

TEST(SamePixels, TheRendererAloneMakesTheSameFloats) {
  const TestServer server;
  client::Client client = server.Connect();
  Scene scene = test::BallScene(700, 64);
  scene.camera.projection = Orthographic{2.4};
  scene.lights.push_back({.kind = PointLight{{3, 2, 1}, true}, .color = glm::vec3(4, 3, 2)});
  scene.lights.back().shadow_density = {1.0F, 0.5F, 0.25F};
  scene.material.phase_g = 0.25F;
  scene.material.physical_scattering = PhysicalScattering{0.75F, 0.5F};
  const client::RenderedFrame frame = MustRender(client, RequestOf(scene));

  auto renderer = FrameRenderer::Create("auto");
  ASSERT_TRUE(renderer.ok()) << renderer.status();
  const auto alone = (*renderer)->Render(test::Beauty(scene), {});
  ASSERT_TRUE(alone.ok()) << alone.status();
  EXPECT_EQ(FloatsOf(frame.outputs[0]), alone->images[0].pixels);
  EXPECT_EQ(frame.header.metadata().gl_renderer(), (*renderer)->device().gl_renderer);
}

TEST(SamePixels, ShadowedFrameIsHalfAngleSlicing) {
  const TestServer server;
  client::Client client = server.Connect();
  Scene scene = test::BallScene(300, 48);
  scene.shadow.light_buffer_size = 512;
  const auto pixels = FloatsOf(MustRender(client, RequestOf(scene)).outputs[0]);
  const oracle::OracleImage exact = oracle::RenderHalfAngle(scene);
  ASSERT_EQ(pixels.size(), exact.rgba.size() * 4);
  double error = 0.0;
  double size = 0.0;
  for (size_t i = 0; i < exact.rgba.size(); ++i) {
    error += std::pow(pixels[i * 4] - exact.rgba[i].x, 2);
    size += std::pow(exact.rgba[i].x, 2);
  }
  EXPECT_GT(size, 0.0);
  EXPECT_LT(std::sqrt(error / size), 0.01);
}

}  // namespace
}  // namespace halflight::loopback
