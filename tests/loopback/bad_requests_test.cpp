// Requests and uploads that must be refused: told by the field's name, and survived. The full list
// of checks is that of tests/server/validation_test.cpp; here it is that they hold over the wire.

#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using Request = v1::RenderFrameRequest;

struct BadRequest {
  const char* field;  // how the message starts
  std::function<void(Request&)> change;
};

v1::Scene& SceneOf(Request& request) { return *request.mutable_scene(); }
v1::Camera& CameraOf(Request& request) { return *SceneOf(request).mutable_camera(); }
v1::Light& LightOf(Request& request) {
  return *SceneOf(request).mutable_lighting()->mutable_lights(0);
}
v1::Material& MaterialOf(Request& request) { return *SceneOf(request).mutable_material(); }
v1::Shadow& ShadowOf(Request& request) { return *SceneOf(request).mutable_shadow(); }

void UseSet(Request& request, const std::function<void(ParticleSet&)>& change) {
  ParticleSet set = *test::Ball(3);
  change(set);
  *SceneOf(request).mutable_inline_particles() = Inline(set);
}

const std::vector<BadRequest>& BadRequests() {
  static const std::vector<BadRequest> requests = {
      {"scene.particles: unset", [](Request& r) { SceneOf(r).clear_particles(); }},
      {"scene.particle_sha256: 5 bytes",
       [](Request& r) { SceneOf(r).set_particle_sha256("short"); }},
      {"scene.inline_particles.position[2].y: nan",
       [](Request& r) { UseSet(r, [](ParticleSet& s) { s.positions[2].y = NAN; }); }},
      {"scene.inline_particles.radius[1]: 0",
       [](Request& r) { UseSet(r, [](ParticleSet& s) {
                          s.radii = {1, 0, 1};
                        }); }},
      {"scene.inline_particles.radius[0]: -1",
       [](Request& r) { UseSet(r, [](ParticleSet& s) {
                          s.radii = {-1, 1, 1};
                        }); }},
      {"scene.inline_particles.opacity[2]: 1.5",
       [](Request& r) { UseSet(r, [](ParticleSet& s) {
                          s.opacities = {0, 1, 1.5};
                        }); }},
      {"scene.inline_particles.color[0].g: -1",
       [](Request& r) {
         UseSet(r, [](ParticleSet& s) { s.colors = {{1, -1, 1}, {1, 1, 1}, {1, 1, 1}}; });
       }},
      {"scene.inline_particles.velocity[1].z: inf",
       [](Request& r) {
         UseSet(r, [](ParticleSet& s) { s.velocities = {{1, 1, 1}, {1, 1, INFINITY}, {1, 1, 1}}; });
       }},
      {"scene.inline_particles.layout.origin.x: inf",
       [](Request& r) { UseSet(r, [](ParticleSet& s) { s.origin.x = INFINITY; }); }},
      {"scene.inline_particles.payload: ",
       [](Request& r) {
         SceneOf(r).mutable_inline_particles()->mutable_payload()->push_back('x');
       }},
      {"scene.inline_particles.",
       [](Request& r) {
         SceneOf(r).mutable_inline_particles()->mutable_layout()->set_count(uint64_t{1} << 62U);
       }},
      {"scene.camera: unset", [](Request& r) { SceneOf(r).clear_camera(); }},
      {"scene.camera.world_to_camera.elements: 15 numbers",
       [](Request& r) { CameraOf(r).mutable_world_to_camera()->mutable_elements()->RemoveLast(); }},
      {"scene.camera.look_at.target: ",
       [](Request& r) {
         CameraOf(r).mutable_look_at()->mutable_eye()->set_x(1);
         CameraOf(r).mutable_look_at()->mutable_target()->set_x(1);
       }},
      {"scene.camera.perspective.vertical_fov_deg: 180",
       [](Request& r) { CameraOf(r).mutable_perspective()->set_vertical_fov_deg(180); }},
      {"scene.camera.orthographic.height: -2",
       [](Request& r) { CameraOf(r).mutable_orthographic()->set_height(-2); }},
      {"scene.camera.width: 1000000", [](Request& r) { CameraOf(r).set_width(1000000); }},
      {"scene.camera.crop.width: ",
       [](Request& r) {
         CameraOf(r).mutable_crop()->set_x(30);
         CameraOf(r).mutable_crop()->set_width(3);
         CameraOf(r).mutable_crop()->set_height(1);
       }},
      {"scene.lighting.lights[0].kind: unset", [](Request& r) { LightOf(r).clear_kind(); }},
      {"scene.lighting.lights[0].directional.direction: (0, 0, 0)",
       [](Request& r) { LightOf(r).mutable_directional()->clear_direction(); }},
      {"scene.lighting.lights[0].density: -1", [](Request& r) { LightOf(r).set_density(-1); }},
      {"scene.lighting.lights[0].color.b: nan",
       [](Request& r) { LightOf(r).mutable_color()->set_b(NAN); }},
      {"scene.lighting.lights[0].point.position: ",
       [](Request& r) { LightOf(r).mutable_point()->mutable_position()->set_x(0.1); }},
      {"scene.lighting.lights: 9 lights",
       [](Request& r) {
         for (int i = 0; i < 8; ++i) {
           *SceneOf(r).mutable_lighting()->add_lights() = LightOf(r);
         }
       }},
      {"scene.material.radius: ", [](Request& r) { MaterialOf(r).clear_radius(); }},
      {"scene.material.radius: -0.5", [](Request& r) { MaterialOf(r).set_radius(-0.5F); }},
      {"scene.material.opacity: 2", [](Request& r) { MaterialOf(r).set_opacity(2); }},
      {"scene.material.phase_g: -1", [](Request& r) { MaterialOf(r).set_phase_g(-1); }},
      {"scene.material.scattering_spread: nan",
       [](Request& r) { MaterialOf(r).set_scattering_spread(NAN); }},
      {"scene.time_offset_s: 1", [](Request& r) { SceneOf(r).set_time_offset_s(1); }},
      {"scene.shadow.slices: ", [](Request& r) { ShadowOf(r).set_slices(4000000000U); }},
      {"scene.shadow.light_buffer_size: 8",
       [](Request& r) { ShadowOf(r).set_light_buffer_size(8); }},
      {"scene.shadow.technique: 77",
       [](Request& r) { ShadowOf(r).set_technique(static_cast<v1::ShadowTechnique>(77)); }},
      {"scene.shadow.blur_texels: 3", [](Request& r) { ShadowOf(r).set_blur_texels(3); }},
      {"scene.sampling.supersample: 9",
       [](Request& r) { SceneOf(r).mutable_sampling()->set_supersample(9); }},
      {"scene.sampling.downsample: 0",
       [](Request& r) { SceneOf(r).mutable_sampling()->set_downsample(0); }},
      {"outputs: 0", [](Request& r) { r.clear_outputs(); }},
      {"outputs[0].kind: unset", [](Request& r) { r.mutable_outputs(0)->clear_kind(); }},
      {"outputs[0].compression: ",
       [](Request& r) { r.mutable_outputs(0)->set_compression(v1::EXR_COMPRESSION_PIZ); }},
      {"outputs[1].light_index: 3",
       [](Request& r) {
         v1::Output& output = *r.add_outputs();
         output = OutputOf(v1::OUTPUT_KIND_LIGHT_BUFFER);
         output.set_light_index(3);
       }},
      {"outputs: ",
       [](Request& r) {
         // One layer a particle, each as large as allowed: over a terabyte.
         UseSet(r, [](ParticleSet& s) { s = *test::Ball(20000); });
         ShadowOf(r).set_slices(20000);
         ShadowOf(r).set_light_buffer_size(4096);
         *r.add_outputs() = OutputOf(v1::OUTPUT_KIND_LIGHT_LAYERS);
       }},
      {"request_id: ", [](Request& r) { r.set_request_id(std::string(1000, 'a')); }},
  };
  return requests;
}

TEST(BadRequests, AreToldByTheFieldAndTheServerRendersOn) {
  const TestServer server;
  const auto stub = server.Stub();
  client::Client client = server.Connect();
  const Request good = RequestOf(test::BallScene(50, 32));
  const auto before = MustRender(client, good).outputs;
  for (const BadRequest& bad : BadRequests()) {
    SCOPED_TRACE(bad.field);
    Request request = good;
    bad.change(request);
    const grpc::Status status = Ask(*stub, request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), StartsWith(bad.field));
    EXPECT_THAT(status.error_message(), HasSubstr("allowed: "));
  }
  EXPECT_EQ(MustRender(client, good).outputs, before);
}

TEST(BadRequests, MessageOverTheLimitIsRefused) {
  const TestServer server;
  const auto stub = server.Stub();
  Request request = RequestOf(test::BallScene(50, 32));
  request.mutable_scene()->mutable_inline_particles()->mutable_payload()->resize(3 * kMiB);
  EXPECT_EQ(Ask(*stub, request).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  client::Client client = server.Connect();
  MustRender(client, RequestOf(test::BallScene(50, 32)));
}

struct BadUpload {
  const char* name;
  grpc::StatusCode code;
  std::function<void(std::vector<v1::UploadParticlesRequest>&)> change;
};

TEST(BadRequests, UploadsThatDoNotFitTogetherCommitNothing) {
  const TestServer server;
  const auto stub = server.Stub();
  client::Client client = server.Connect();
  const client::EncodedParticles particles = Encoded(*test::Ball(100));
  std::vector<v1::UploadParticlesRequest> good(3);
  *good[0].mutable_header()->mutable_layout() = particles.layout;
  good[0].mutable_header()->set_byte_size(particles.payload.size());
  good[0].mutable_header()->set_sha256(particles.sha256);
  good[1].set_chunk(particles.payload);
  good[2].mutable_finish()->set_byte_size(particles.payload.size());
  good[2].mutable_finish()->set_sha256(particles.sha256);
  using Parts = std::vector<v1::UploadParticlesRequest>;
  constexpr auto kInvalid = grpc::StatusCode::INVALID_ARGUMENT;
  const std::vector<BadUpload> uploads = {
      {"nothing", kInvalid, [](Parts& p) { p.clear(); }},
      {"no header", kInvalid, [](Parts& p) { p.erase(p.begin()); }},
      {"no finish", kInvalid, [](Parts& p) { p.pop_back(); }},
      {"two headers", kInvalid, [](Parts& p) { p.insert(p.begin(), p[0]); }},
      {"chunk cut short", kInvalid, [](Parts& p) { p[1].mutable_chunk()->pop_back(); }},
      {"chunk twice", kInvalid, [](Parts& p) { p.insert(p.begin() + 1, p[1]); }},
      {"size of another set", kInvalid,
       [](Parts& p) { p[0].mutable_header()->mutable_layout()->set_count(99); }},
      {"finish of another set", kInvalid,
       [](Parts& p) { p[2].mutable_finish()->set_sha256(std::string(32, 'x')); }},
      {"changed byte", grpc::StatusCode::DATA_LOSS, [](Parts& p) { (*p[1].mutable_chunk())[5]++; }},
      {"value out of range", kInvalid,
       [](Parts& p) {
         ParticleSet set = *test::Ball(100);
         set.positions[7].x = NAN;
         const client::EncodedParticles bad = Encoded(set);
         p[0].mutable_header()->set_sha256(bad.sha256);
         p[1].set_chunk(bad.payload);
         p[2].mutable_finish()->set_sha256(bad.sha256);
       }},
  };
  for (const BadUpload& bad : uploads) {
    SCOPED_TRACE(bad.name);
    Parts parts = good;
    bad.change(parts);
    grpc::ClientContext context;
    v1::UploadParticlesResponse response;
    const auto writer = stub->UploadParticles(&context, &response);
    for (const v1::UploadParticlesRequest& part : parts) {
      writer->Write(part);
    }
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    EXPECT_EQ(status.error_code(), bad.code) << status.error_message();
    EXPECT_FALSE(status.error_message().empty());
    EXPECT_EQ(client.FindMissing({particles.sha256}).value().size(), 1U);
  }
  EXPECT_TRUE(client.EnsureUploaded(particles).ok());
  EXPECT_TRUE(client.FindMissing({particles.sha256}).value().empty());
}

}  // namespace
}  // namespace halflight::loopback
