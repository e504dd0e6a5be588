// Particle sets by name: asked for, sent, dropped, sent again; and what the attributes do once they
// have arrived.

#include <cmath>

#include <gtest/gtest.h>

#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/oracle/oracle.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

// Room for one set of 400 positions, not for two.
ServerLimits RoomForOneSet() {
  ServerLimits limits;
  limits.max_cache_bytes = 8000;
  limits.max_particle_bytes = 8000;
  return limits;
}

v1::RenderFrameRequest Naming(const Scene& scene, const std::string& sha256) {
  v1::RenderFrameRequest request = RequestWithoutParticles(scene);
  request.mutable_scene()->set_particle_sha256(sha256);
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY);
  return request;
}

// Every attribute, each different from particle to particle; origin at zero.
Scene SceneOfAllAttributes() {
  Scene scene = test::BallScene(200, 48);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  for (size_t i = 0; i < set->size(); ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(set->size());
    // Multiples of 2^-16, which an origin of 1e7 leaves room for in float64.
    set->positions[i] = glm::round(set->positions[i] * 65536.0F) / 65536.0F;
    set->radii.push_back(0.05F + 0.2F * t);
    set->opacities.push_back(0.1F + 0.6F * (1.0F - t));
    set->colors.emplace_back(t, 1.0F - t, 0.5F);
    set->velocities.emplace_back(0.5F, -0.25F * t, 0.125F);
    set->emissions.emplace_back(0.0F, 0.25F * t, 0.75F);
  }
  scene.particles = set;
  scene.time_offset_s = 0.5;
  return scene;
}

TEST(ParticleCache, SetIsMissingUntilItIsSent) {
  const TestServer server;
  client::Client client = server.Connect();
  const client::EncodedParticles one = Encoded(*test::Ball(400, 1));
  const client::EncodedParticles two = Encoded(*test::Ball(400, 2));
  ASSERT_NE(one.sha256, two.sha256);
  const std::vector<std::string> both = {one.sha256, two.sha256};
  EXPECT_EQ(client.FindMissing(both).value(), both);
  ASSERT_TRUE(client.EnsureUploaded(two).ok());
  EXPECT_EQ(client.FindMissing(both).value(), std::vector{one.sha256});
  ASSERT_TRUE(client.EnsureUploaded(one).ok());
  EXPECT_TRUE(client.FindMissing(both).value().empty());
  EXPECT_TRUE(client.EnsureUploaded(one).ok()) << "sent again it is no error";
}

TEST(ParticleCache, NamedAndInlineParticlesGiveTheSameFrame) {
  const TestServer server;
  client::Client client = server.Connect();
  const Scene scene = test::BallScene(400, 48);
  const client::EncodedParticles particles = Encoded(*scene.particles);
  const client::RenderedFrame named =
      MustRender(client, Naming(scene, particles.sha256), &particles);
  const client::RenderedFrame carried = MustRender(client, RequestOf(scene));
  EXPECT_EQ(named.outputs, carried.outputs);
  EXPECT_EQ(named.header.metadata().particle_sha256(), particles.sha256);
  EXPECT_EQ(carried.header.metadata().particle_sha256(), particles.sha256);
  EXPECT_EQ(named.header.metadata().particle_count(), 400U);
}

TEST(ParticleCache, DroppedSetIsNotFoundUntilTheClientSendsItAgain) {
  const TestServer server(RoomForOneSet());
  client::Client client = server.Connect();
  const Scene scene = test::BallScene(400, 32);
  const client::EncodedParticles one = Encoded(*scene.particles);
  const v1::RenderFrameRequest request = Naming(scene, one.sha256);
  const client::RenderedFrame first = MustRender(client, request, &one);
  ASSERT_TRUE(client.EnsureUploaded(Encoded(*test::Ball(400, 2))).ok());

  EXPECT_EQ(client.FindMissing({one.sha256}).value(), std::vector{one.sha256});
  const auto refused = client.RenderFrame(request);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kNotFound) << refused.status();
  EXPECT_EQ(MustRender(client, request, &one).outputs, first.outputs);
}

TEST(ParticleCache, SequenceEndsWellThoughTheCacheHoldsOneOfItsSets) {
  const TestServer server(RoomForOneSet());
  client::Client client = server.Connect();
  const Scene scene = test::BallScene(400, 16);
  const auto set_of = [](uint64_t index) { return test::Ball(400, 1 + index % 3); };
  std::vector<std::string> frames;
  const absl::Status status = client.RenderSequence(
      9,
      [&](uint64_t index) -> absl::StatusOr<client::SequenceFrame> {
        return client::SequenceFrame{Naming(scene, ""), Encoded(*set_of(index))};
      },
      [&](uint64_t index, const client::RenderedFrame& frame) {
        EXPECT_EQ(frame.header.metadata().particle_sha256(), Encoded(*set_of(index)).sha256);
        frames.push_back(frame.outputs[0]);
        return absl::OkStatus();
      });
  EXPECT_TRUE(status.ok()) << status;
  ASSERT_EQ(frames.size(), 9U);
  EXPECT_EQ(frames[0], frames[3]);
  EXPECT_NE(frames[0], frames[1]);
}

TEST(ParticleCache, SetThatCanNeverFitIsRefusedForGood) {
  const TestServer server(RoomForOneSet());
  client::Client client = server.Connect();
  const client::EncodedParticles large = Encoded(*test::Ball(1000, 1));
  const absl::Status status = client.EnsureUploaded(large);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
}

TEST(ParticleCache, AttributesReachEveryParticle) {
  const TestServer server;
  client::Client client = server.Connect();
  Scene scene = SceneOfAllAttributes();
  scene.lights = {test::Sun({1, -1, -0.5}, 0.0F)};
  const client::EncodedParticles particles = Encoded(*scene.particles);
  const auto pixels =
      FloatsOf(MustRender(client, Naming(scene, particles.sha256), &particles).outputs[0]);
  const oracle::OracleImage exact = oracle::RenderUnshadowed(scene);
  ASSERT_EQ(pixels.size(), exact.rgba.size() * 4);
  double squares = 0.0;
  double largest = 0.0;
  for (size_t i = 0; i < exact.rgba.size(); ++i) {
    for (int c = 0; c < 4; ++c) {
      squares += std::pow(pixels[i * 4 + static_cast<size_t>(c)] - exact.rgba[i][c], 2);
      largest = std::max(largest, exact.rgba[i][c]);
    }
  }
  EXPECT_GT(largest, 0.5);
  // Where spheres cross, the order of centres and that of ray points may differ.
  EXPECT_LT(std::sqrt(squares / static_cast<double>(pixels.size())), 0.02);
}

TEST(ParticleCache, FarOriginGivesTheSameFrameAsNone) {
  const TestServer server;
  client::Client client = server.Connect();
  const Scene near = SceneOfAllAttributes();
  Scene far = near;
  auto set = std::make_shared<ParticleSet>(*near.particles);
  set->origin = {1e7, -2e7, 3e7};
  far.particles = set;
  far.camera = test::LookAt(set->origin + glm::dvec3(0, 0, 4), set->origin, 48, 48);
  const client::EncodedParticles particles = Encoded(*set);
  const auto moved =
      FloatsOf(MustRender(client, Naming(far, particles.sha256), &particles).outputs[0]);
  const auto still = FloatsOf(MustRender(client, RequestOf(near)).outputs[0]);
  EXPECT_LT(MaxDifference(moved, still), 1e-5);
}

}  // namespace
}  // namespace halflight::loopback
