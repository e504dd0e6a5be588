// Frames over the wire that say little: which technique they get, and what they take over from the
// ones before.

#include <gtest/gtest.h>

#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

// Of uploaded particles, with no word of how shadows are computed.
v1::RenderFrameRequest OpenRequest(const Scene& scene, const std::string& sha256) {
  v1::RenderFrameRequest request = RequestWithoutParticles(scene);
  request.mutable_scene()->clear_shadow();
  request.mutable_scene()->set_particle_sha256(sha256);
  *request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY);
  return request;
}

uint32_t CountOf(const client::RenderedFrame& frame, const std::string& pass) {
  for (const v1::PlannedPass& planned : frame.header.plan().passes()) {
    if (planned.name() == pass) return planned.count();
  }
  ADD_FAILURE() << "no pass " << pass;
  return 0;
}

TEST(OpenTechnique, IsNamedInTheMetadata) {
  const TestServer server;
  client::Client client = server.Connect();
  const Scene scene = test::BallScene(200, 32);
  const client::EncodedParticles particles = Encoded(*scene.particles);
  ASSERT_TRUE(client.EnsureUploaded(particles).ok());
  v1::RenderFrameRequest request = OpenRequest(scene, particles.sha256);
  EXPECT_EQ(MustRender(client, request).header.metadata().shadow().technique(),
            Engine().device().software ? v1::SHADOW_TECHNIQUE_LIGHT_SWEEP
                                       : v1::SHADOW_TECHNIQUE_HALF_ANGLE);
  request.mutable_scene()->mutable_shadow()->set_slices(16);
  EXPECT_EQ(MustRender(client, request).header.metadata().shadow().technique(),
            v1::SHADOW_TECHNIQUE_HALF_ANGLE);
}

TEST(Turntable, PaysForTheLightOnceAndShowsTheSame) {
  const TestServer server;
  client::Client client = server.Connect();
  Scene scene = test::BallScene(300, 48);
  scene.shadow.technique = ShadowTechniqueKind::kLightSweep;
  const client::EncodedParticles particles = Encoded(*scene.particles);
  ASSERT_TRUE(client.EnsureUploaded(particles).ok());
  const auto turned = [&](double x) {
    scene.camera = test::LookAt({x, 0, 4}, {0, 0, 0}, 48, 48);
    v1::RenderFrameRequest request = OpenRequest(scene, particles.sha256);
    request.mutable_scene()->mutable_shadow()->set_technique(v1::SHADOW_TECHNIQUE_LIGHT_SWEEP);
    return request;
  };
  EXPECT_EQ(CountOf(MustRender(client, turned(0.0)), "fit the light over every footprint"), 1U);
  const client::RenderedFrame next = MustRender(client, turned(0.2));
  EXPECT_EQ(CountOf(next, "fit the light over every footprint"), 0U);
  EXPECT_EQ(CountOf(next, "sort by distance from the eye"), 1U);

  // Inline particles are a set of their own, which nothing was kept of.
  v1::RenderFrameRequest alone = turned(0.2);
  *alone.mutable_scene()->mutable_inline_particles() = Inline(*scene.particles);
  const client::RenderedFrame fresh = MustRender(client, alone);
  EXPECT_EQ(CountOf(fresh, "fit the light over every footprint"), 1U);
  EXPECT_EQ(fresh.outputs, next.outputs);
}

}  // namespace
}  // namespace halflight::loopback
