// halflightd's log as programs read it: every line an object, every call found by its name.

#include <csignal>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include "tests/metrics/observed_daemon.h"
#include "tests/server/fake_engine.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

using google::protobuf::Struct;
using testing::Chunk;
using testing::Describe;
using testing::Finish;
using testing::Header;
using testing::MakeRequest;
using ::testing::MatchesRegex;
using ::testing::StartsWith;
using testing::TestCaller;

class JsonLog : public testing::ObservedDaemon {
 protected:
  // All lines; the server has ended.
  std::vector<Struct> Lines() {
    server_->Signal(SIGTERM);
    EXPECT_EQ(server_->Wait(), 0) << server_->Err();
    std::vector<Struct> read;
    std::istringstream lines(server_->Err());
    for (std::string line; std::getline(lines, line);) {
      EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(line, &read.emplace_back()).ok())
          << line;
    }
    return read;
  }

  static std::string Text(const Struct& line, const std::string& key) {
    const auto found = line.fields().find(key);
    return found == line.fields().end() ? "" : found->second.string_value();
  }
  static double Number(const Struct& line, const std::string& key) {
    const auto found = line.fields().find(key);
    return found == line.fields().end() || !found->second.has_number_value()
               ? -1.0
               : found->second.number_value();
  }

  // The one line of an event that carries the name; an empty one where there is none, or several.
  static Struct LineOf(const std::vector<Struct>& lines, const std::string& event,
                       const std::string& request_id) {
    std::vector<Struct> found;
    for (const Struct& line : lines) {
      if (Text(line, "event") == event && Text(line, "request_id") == request_id) {
        found.push_back(line);
      }
    }
    EXPECT_EQ(found.size(), 1U) << event << " " << request_id;
    return found.size() == 1 ? found[0] : Struct();
  }
};

TEST_F(JsonLog, EveryLineIsAnObjectAndEveryCallHasItsName) {
  Start({"--log-format", "json", "--log-level", "debug"});
  TestCaller alice = Alice();
  EXPECT_TRUE(alice.Render(MakeRequest(), "good \"frame\"").status.ok());
  v1::RenderFrameRequest wrong = MakeRequest();
  wrong.mutable_scene()->mutable_camera()->mutable_perspective()->set_vertical_fov_deg(200);
  wrong.set_request_id("wrong");
  EXPECT_EQ(alice.Render(wrong).request_id, "wrong");
  EXPECT_EQ(Stranger().Render(MakeRequest(), "stranger").request_id, "stranger");
  const std::string made = alice.Render({}).request_id;
  EXPECT_THAT(made, MatchesRegex("[0-9a-f]{16}-[0-9]+"));

  v1::RenderFrameRequest garbled = MakeRequest();
  garbled.set_request_id("\xff");  // no UTF-8: Protobuf says so as well
  EXPECT_FALSE(alice.Render(garbled, "garbled").status.ok());

  const v1::InlineParticles set = testing::MakeParticles(
      1000, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS});
  const v1::ParticleSetDescription header = Describe(set);
  const std::vector<v1::UploadParticlesRequest> messages = {Header(header), Chunk(set.payload()),
                                                            Finish(header)};
  EXPECT_TRUE(alice.Upload(messages, {}, "upload").status.ok());
  EXPECT_FALSE(alice.Upload({messages[1]}, {}, "no header").status.ok());
  v1::ParticleSetDescription other = header;
  other.set_sha256(std::string(32, 'x'));
  const auto begun = [this] {
    return Becomes(R"(halflight_uploads_begun_total{resumed="false"})", 2.0);
  };
  EXPECT_FALSE(alice.Upload({Header(other)}, begun, "gone").status.ok());

  const std::vector<Struct> lines = Lines();
  ASSERT_GE(lines.size(), 10U);
  for (const Struct& line : lines) {
    EXPECT_THAT(Text(line, "time"), MatchesRegex("[0-9-]{10}T[0-9:.]{12}[+-][0-9:]{5}"));
    EXPECT_NE(Text(line, "level"), "");
    EXPECT_NE(Text(line, "event"), "");
  }
  EXPECT_EQ(Text(lines.back(), "event"), "stopped");

  const Struct frame = LineOf(lines, "frame", "good \"frame\"");
  EXPECT_EQ(Text(frame, "tenant"), "alice");
  EXPECT_THAT(Text(frame, "peer"), StartsWith("ipv4:127.0.0.1:"));
  EXPECT_EQ(Number(frame, "composite_ms"), 0.25);
  EXPECT_EQ(Number(frame, "particles"), 2.0);
  EXPECT_EQ(Text(frame, "outcome"), "OK");
  const Struct good = LineOf(lines, "call", "good \"frame\"");
  EXPECT_EQ(Text(good, "level"), "debug");
  EXPECT_EQ(Text(good, "outcome"), "OK");

  const Struct refused = LineOf(lines, "call", "wrong");
  EXPECT_EQ(Text(refused, "level"), "info");
  EXPECT_EQ(Text(refused, "rpc"), "RenderFrame");
  EXPECT_EQ(Text(refused, "tenant"), "alice");
  EXPECT_EQ(Text(refused, "outcome"), "INVALID_ARGUMENT");
  EXPECT_EQ(Text(refused, "reason"), "INVALID_FIELD");
  EXPECT_THAT(Text(refused, "message"), StartsWith("scene.camera.perspective"));
  EXPECT_EQ(Number(refused, "received_bytes"), static_cast<double>(wrong.ByteSizeLong()));
  EXPECT_EQ(Number(refused, "sent_bytes"), 0.0);
  EXPECT_GE(Number(refused, "total_ms"), 0.0);
  EXPECT_EQ(Text(LineOf(lines, "call", made), "outcome"), "INVALID_ARGUMENT");
  EXPECT_EQ(Text(LineOf(lines, "call", "garbled"), "outcome"), "INVALID_ARGUMENT");

  const Struct stranger = LineOf(lines, "call", "stranger");
  EXPECT_EQ(Text(stranger, "reason"), "UNAUTHENTICATED");
  EXPECT_EQ(stranger.fields().count("tenant"), 0U);
  EXPECT_THAT(Text(stranger, "peer"), StartsWith("ipv4:127.0.0.1:"));

  const Struct upload = LineOf(lines, "call", "upload");
  EXPECT_EQ(Text(upload, "level"), "info");
  EXPECT_EQ(Text(upload, "outcome"), "OK");
  EXPECT_EQ(Text(upload, "tenant"), "alice");
  EXPECT_EQ(Number(upload, "received_bytes"),
            static_cast<double>(messages[0].ByteSizeLong() + messages[1].ByteSizeLong() +
                                messages[2].ByteSizeLong()));
  EXPECT_EQ(Text(LineOf(lines, "call", "no header"), "outcome"), "INVALID_ARGUMENT");
  EXPECT_EQ(Text(LineOf(lines, "call", "gone"), "outcome"), "CANCELLED");
}

TEST_F(JsonLog, FramesOfASequenceAreFoundByTheirCall) {
  Start({"--log-format", "json"});
  TestCaller alice = Alice();
  grpc::ClientContext context;
  alice.Prepare(context, "shot");
  auto stream = alice.stub().RenderSequence(&context);
  v1::RenderSequenceRequest request;
  *request.mutable_frame() = MakeRequest();
  stream->Write(request);
  request.mutable_frame()->set_request_id("mine");
  v1::Camera& camera = *request.mutable_frame()->mutable_scene()->mutable_camera();
  camera.mutable_perspective()->set_vertical_fov_deg(200);
  stream->Write(request);
  stream->WritesDone();
  v1::RenderSequenceResponse response;
  while (stream->Read(&response)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);

  const std::vector<Struct> lines = Lines();
  const Struct first = LineOf(lines, "frame", "shot.0");
  EXPECT_EQ(Text(first, "call_id"), "shot");
  EXPECT_EQ(Text(first, "outcome"), "OK");
  const Struct second = LineOf(lines, "frame", "mine");
  EXPECT_EQ(Text(second, "call_id"), "shot");
  EXPECT_EQ(Text(second, "outcome"), "INVALID_ARGUMENT");
  const Struct call = LineOf(lines, "call", "shot");
  EXPECT_EQ(Text(call, "rpc"), "RenderSequence");
  EXPECT_THAT(Text(call, "message"), StartsWith("frame 1: scene.camera.perspective"));
  EXPECT_GT(Number(call, "sent_bytes"), 64.0);
}

}  // namespace
}  // namespace halflight
