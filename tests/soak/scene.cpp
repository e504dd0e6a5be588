#include "tests/soak/scene.h"

#include "client/client.h"
#include "tests/loopback/wire_scene.h"
#include "tests/renderer/test_scene.h"
#include "tests/soak/scenario.h"

namespace halflight::soak {

client::EncodedParticles BallOf(size_t particles, uint32_t seed) {
  return loopback::Encoded(*test::Ball(particles, seed));
}

v1::RenderFrameRequest FrameOf(const std::string& sha256, int pixels, int slices) {
  Scene scene = test::BallScene(1, pixels);
  scene.shadow.slices = slices;
  v1::RenderFrameRequest request = loopback::RequestWithoutParticles(scene);
  request.mutable_scene()->set_particle_sha256(sha256);
  *request.add_outputs() = loopback::OutputOf(v1::OUTPUT_KIND_BEAUTY);
  return request;
}

v1::RenderFrameRequest SweepOf(const std::string& sha256, int pixels) {
  v1::RenderFrameRequest request = FrameOf(sha256, pixels);
  request.mutable_scene()->mutable_shadow()->Clear();
  request.mutable_scene()->mutable_shadow()->set_technique(v1::SHADOW_TECHNIQUE_LIGHT_SWEEP);
  return request;
}

void Upload(const std::string& address, const client::EncodedParticles& particles,
            const std::string& token) {
  client::ClientOptions options;
  options.security.token = token;
  auto client = client::Client::Connect(address, options);
  Require(client.status(), "connect");
  Require(client->EnsureUploaded(particles), "upload");
}

CallOptions Ask(const v1::RenderFrameRequest& request) {
  return {.messages = {Bytes(request.SerializeAsString())}, .keep_frame = true};
}

std::vector<std::string> MustRender(const std::shared_ptr<grpc::Channel>& channel,
                                    const v1::RenderFrameRequest& request) {
  const auto call = Call::Start(channel, Ask(request));
  const grpc::Status& status = call->Wait();
  Require(status.ok() && call->whole(), "a frame: " + status.error_message());
  return call->frame().outputs;
}

}  // namespace halflight::soak
