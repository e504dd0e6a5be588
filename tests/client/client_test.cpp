// The client against a service in this process: retries, uploads, checks of what comes back.
#include "client/client.h"

#include <gmock/gmock.h>

#include <thread>

#include "client/status_text.h"
#include "halflight/sha256.h"
#include "tests/client/fake_service.h"
#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

using absl::StatusCode;
using testing::ElementsAre;

const grpc::Status kUnavailable(grpc::StatusCode::UNAVAILABLE, "draining");
const grpc::Status kCancelled(grpc::StatusCode::CANCELLED, "stalled");
const grpc::Status kExhausted(grpc::StatusCode::RESOURCE_EXHAUSTED, "queue is full");

EncodedParticles SomeParticles(float seed, size_t count = 100) {
  Particles particles;
  particles.positions.assign(3 * count, seed);
  return EncodeParticles(particles);
}

v1::RenderFrameRequest SomeRequest(int outputs = 2) {
  v1::RenderFrameRequest request;
  for (int i = 0; i < outputs; ++i) {
    request.add_outputs()->set_kind(v1::OUTPUT_KIND_BEAUTY);
  }
  return request;
}

v1::Output& OutputOf(v1::RenderSequenceResponse& message, int index) {
  return *message.mutable_header()->mutable_outputs(index)->mutable_output();
}

class ClientTest : public testing::Test {
 protected:
  Client Connect(ClientOptions options = {}) {
    options.first_backoff = std::chrono::milliseconds(2);
    return *Client::Connect(service_.address(), options);
  }

  FakeService service_;
};

TEST(Client, TakesAddressesOfTwoKinds) {
  EXPECT_TRUE(Client::Connect("localhost:1").ok());
  EXPECT_TRUE(Client::Connect("[::1]:65535").ok());
  EXPECT_TRUE(Client::Connect("unix:/tmp/x").ok());
  for (const char* address : {"", "localhost", "localhost:", ":1", "a:0", "a:65536", "unix:"}) {
    ExpectError(Client::Connect(address).status(), StatusCode::kInvalidArgument,
                {std::string("'") + address + "'", "host:port", "unix:path"});
  }
}

TEST_F(ClientTest, UploadsThenRenders) {
  const EncodedParticles particles = SomeParticles(1, 100000);
  const auto frame = Connect().RenderFrame(SomeRequest(), &particles);
  ASSERT_TRUE(frame.ok()) << frame.status();
  v1::RenderFrameRequest sent = SomeRequest();
  sent.mutable_scene()->set_particle_sha256(particles.sha256);
  EXPECT_THAT(frame->outputs,
              ElementsAre(FakeService::OutputBytes(sent, 0), FakeService::OutputBytes(sent, 1)));
  EXPECT_EQ(service_.largest_chunk, 262144U);
  EXPECT_THAT(service_.routes, ElementsAre(ToHex(particles.sha256)));
}

TEST_F(ClientTest, DoesNotUploadWhatTheServerHas) {
  const EncodedParticles particles = SomeParticles(1);
  Client client = Connect();
  ASSERT_TRUE(client.RenderFrame(SomeRequest(), &particles).ok());
  ASSERT_TRUE(client.RenderFrame(SomeRequest(), &particles).ok());
  EXPECT_EQ(service_.Calls("UploadParticles"), 1);
  const auto missing = client.FindMissing({particles.sha256, std::string(32, 'x')});
  ASSERT_TRUE(missing.ok());
  EXPECT_THAT(*missing, ElementsAre(std::string(32, 'x')));
}

TEST_F(ClientTest, TriesAgainWhenTheServerIsBusy) {
  for (const char* rpc : {"QueryUpload", "UploadParticles", "RenderFrame"}) {
    service_.FailNext(rpc, {kUnavailable, kExhausted});
  }
  const EncodedParticles particles = SomeParticles(1);
  const auto frame = Connect().RenderFrame(SomeRequest(), &particles);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(service_.Calls("QueryUpload"), 5) << "each try of an upload begins with one";
  EXPECT_EQ(service_.Calls("UploadParticles"), 3);
  EXPECT_EQ(service_.Calls("RenderFrame"), 3);
}

TEST_F(ClientTest, DoesNotRepeatWhatIsTooLargeForTheServer) {
  service_.gives_hints = false;  // as gRPC itself, of a message beyond the bound
  service_.FailNext("RenderFrame", {{grpc::StatusCode::RESOURCE_EXHAUSTED, "message too large"}});
  const EncodedParticles particles = SomeParticles(1);
  ExpectError(Connect().RenderFrame(SomeRequest(), &particles).status(),
              StatusCode::kResourceExhausted, {"message too large"});
  EXPECT_EQ(service_.Calls("RenderFrame"), 1);
}

// Such as its guard against peers that stall.
TEST_F(ClientTest, TriesAgainWhatTheServerCancelled) {
  service_.FailNext("RenderFrame", {kCancelled, kCancelled, grpc::Status::OK, kCancelled});
  const EncodedParticles particles = SomeParticles(1);
  Client client = Connect();
  EXPECT_TRUE(client.RenderFrame(SomeRequest(), &particles).ok());
  EXPECT_EQ(service_.Calls("RenderFrame"), 3);
  ClientOptions options;
  options.max_attempts = 1;
  ExpectError(Connect(options).RenderFrame(SomeRequest(), &particles).status(),
              StatusCode::kUnavailable, {"stalled"});
}

TEST_F(ClientTest, UploadGoesOnWhereItBrokeOff) {
  constexpr uint64_t kChunk = 262144;
  service_.break_uploads_at = {2 * kChunk, 3 * kChunk};
  const EncodedParticles particles = SomeParticles(1, 100000);  // 1,200,000 bytes
  Client client = Connect();
  const absl::Status status = client.EnsureUploaded(particles);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_THAT(service_.resume_offsets, ElementsAre(0, 2 * kChunk, 3 * kChunk));
  EXPECT_EQ(client.upload_totals().saved_bytes, 3 * kChunk);
  // What is on its way when a stream breaks off is sent in vain.
  EXPECT_GE(client.upload_totals().sent_bytes, particles.payload.size());
}

TEST_F(ClientTest, UploadThatAnotherProcessBeganGoesOn) {
  const EncodedParticles particles = SomeParticles(1, 1000);
  service_.KeepPartial(particles.sha256, particles.payload.substr(0, 5000));
  Client client = Connect();
  ASSERT_TRUE(client.EnsureUploaded(particles).ok());
  EXPECT_THAT(service_.resume_offsets, ElementsAre(5000));
  EXPECT_EQ(client.upload_totals().saved_bytes, 5000U);
  EXPECT_EQ(client.upload_totals().sent_bytes, 7000U);
}

TEST_F(ClientTest, OtherBytesUnderTheSameNameAreSentAnew) {
  const EncodedParticles particles = SomeParticles(1, 1000);
  service_.KeepPartial(particles.sha256, std::string(5000, 'x'));
  Client client = Connect();
  const absl::Status status = client.EnsureUploaded(particles);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_THAT(service_.resume_offsets, ElementsAre(5000, 0));
  EXPECT_EQ(client.upload_totals().saved_bytes, 0U);
}

TEST_F(ClientTest, UploadsToAServerThatCannotResume) {
  service_.FailNext("QueryUpload", {{grpc::StatusCode::UNIMPLEMENTED, "no such call"}});
  ASSERT_TRUE(Connect().EnsureUploaded(SomeParticles(1)).ok());
  EXPECT_THAT(service_.resume_offsets, ElementsAre(0));
}

TEST_F(ClientTest, UploadThatKeepsBreakingOffEndsWithTheLastTry) {
  service_.break_uploads_at = {1, 1, 1, 1};
  ClientOptions options;
  options.max_attempts = 3;
  ExpectError(Connect(options).EnsureUploaded(SomeParticles(1, 200000)), StatusCode::kUnavailable,
              {"after 3 of 3 tries", "broken off"});
  EXPECT_EQ(service_.Calls("UploadParticles"), 3);
}

TEST_F(ClientTest, GivesUpAfterTheLastTry) {
  service_.FailNext("GetServerInfo", std::vector(5, kUnavailable));
  ClientOptions options;
  options.max_attempts = 3;
  ExpectError(Connect(options).GetServerInfo().status(), StatusCode::kUnavailable,
              {"after 3 of 3 tries", "draining", service_.address()});
  EXPECT_EQ(service_.Calls("GetServerInfo"), 3);
}

TEST_F(ClientTest, DoesNotRepeatWhatTheServerRefused) {
  service_.FailNext("RenderFrame",
                    {{grpc::StatusCode::INVALID_ARGUMENT, "scene.camera.width is 0"}});
  const EncodedParticles particles = SomeParticles(1);
  ExpectError(Connect().RenderFrame(SomeRequest(), &particles).status(),
              StatusCode::kInvalidArgument, {"scene.camera.width is 0"});
  EXPECT_EQ(service_.Calls("RenderFrame"), 1);
}

TEST_F(ClientTest, UploadsOnceMoreWhatTheServerDroppedInBetween) {
  service_.evict_after_upload = 1;
  const EncodedParticles particles = SomeParticles(1);
  const auto frame = Connect().RenderFrame(SomeRequest(), &particles);
  EXPECT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(service_.Calls("UploadParticles"), 2);
  EXPECT_EQ(service_.Calls("RenderFrame"), 2);
}

TEST_F(ClientTest, UploadsOnlyOnceMore) {
  service_.evict_after_upload = 9;
  const EncodedParticles particles = SomeParticles(1);
  ExpectError(Connect().RenderFrame(SomeRequest(), &particles).status(), StatusCode::kNotFound,
              {"particle_sha256"});
  EXPECT_EQ(service_.Calls("UploadParticles"), 2);
}

TEST_F(ClientTest, DetectsDamagedOutputs) {
  struct Case {
    const char* message;
    std::function<void(v1::RenderSequenceResponse&)> tamper;
  };
  const EncodedParticles particles = SomeParticles(1);
  Client client = Connect();
  for (const Case& damage : {
           Case{"CRC-32C",
                [](auto& m) {
                  if (m.has_chunk()) (*m.mutable_chunk()->mutable_data())[7] ^= 1;
                }},
           Case{"offset",
                [](auto& m) {
                  if (m.has_chunk() && m.chunk().offset() > 0)
                    m.mutable_chunk()->set_offset(262145);
                }},
           Case{"came before the trailer",
                [](auto& m) {
                  if (m.has_chunk() && m.chunk().output_index() == 1) m.clear_chunk();
                }},
           Case{"output 1",
                [](auto& m) {
                  if (m.has_chunk()) m.mutable_chunk()->set_output_index(1);
                }},
           Case{"before the frame's trailer",
                [](auto& m) {
                  if (m.has_trailer()) m.clear_trailer();
                }},
           Case{"before the frame's header",
                [](auto& m) {
                  if (m.has_header()) m.clear_header();
                }},
           Case{"the frame has 1 outputs, expected 2",
                [](auto& m) {
                  if (m.has_header()) m.mutable_header()->mutable_outputs()->RemoveLast();
                }},
           Case{"kind is OUTPUT_KIND_DEPTH, expected OUTPUT_KIND_BEAUTY",
                [](auto& m) {
                  if (m.has_header()) OutputOf(m, 1).set_kind(v1::OUTPUT_KIND_DEPTH);
                }},
           Case{"format is IMAGE_FORMAT_PNG16, expected IMAGE_FORMAT_PNG8",
                [](auto& m) {
                  if (m.has_header()) OutputOf(m, 0).set_format(v1::IMAGE_FORMAT_PNG16);
                }},
           Case{"1 checksums, expected 2",
                [](auto& m) {
                  if (m.has_trailer()) m.mutable_trailer()->mutable_output_crc32c()->RemoveLast();
                }},
       }) {
    service_.tamper = damage.tamper;
    v1::RenderFrameRequest request = SomeRequest();
    request.mutable_outputs(0)->set_format(v1::IMAGE_FORMAT_PNG8);
    ExpectError(client.RenderFrame(request, &particles).status(), StatusCode::kDataLoss,
                {damage.message});
  }
}

TEST_F(ClientTest, TakesNoMoreBytesThanItsOptionAllows) {
  const EncodedParticles particles = SomeParticles(1);
  ClientOptions options;
  options.max_frame_bytes = 2 * 400033;  // each output has 32 + 1 + 400000
  Client client = Connect(options);
  EXPECT_TRUE(client.RenderFrame(SomeRequest(), &particles).ok());
  service_.tamper = [](auto& m) {
    if (m.has_header()) m.mutable_header()->mutable_outputs(1)->set_byte_size(UINT64_MAX);
  };
  ExpectError(client.RenderFrame(SomeRequest(), &particles).status(), StatusCode::kOutOfRange,
              {"max_frame_bytes", "18446744073709551615", "allowed: 800066"});
}

TEST(Client, ConnectsAgainToAServerThatComesLate) {
  const TestDirectory directory;
  const std::string address = "unix:" + (directory / "socket");
  ClientOptions options;
  options.max_attempts = 100;
  options.first_backoff = std::chrono::milliseconds(10);
  // gRPC by itself looks after an idle channel every 5 s only.
  options.timeout = std::chrono::seconds(4);
  Client client = *Client::Connect(address, options);
  EXPECT_FALSE(client.WaitForConnection(std::chrono::milliseconds(10)));
  std::unique_ptr<FakeService> service;
  const std::jthread starter([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    service = std::make_unique<FakeService>(address);
  });
  EXPECT_TRUE(client.GetServerInfo().ok());
}

TEST_F(ClientTest, EndsAtItsDeadline) {
  service_.FailNext("GetServerInfo", std::vector(1000, kUnavailable));
  ClientOptions options;
  options.max_attempts = 1000;
  options.timeout = std::chrono::milliseconds(200);
  EXPECT_FALSE(Connect(options).GetServerInfo().ok());
  EXPECT_LT(service_.Calls("GetServerInfo"), 1000);
}

TEST_F(ClientTest, SaysWhichTimeWasTooShort) {
  service_.tamper = [](auto&) { std::this_thread::sleep_for(std::chrono::milliseconds(500)); };
  const EncodedParticles particles = SomeParticles(1);
  ASSERT_TRUE(Connect().EnsureUploaded(particles).ok());
  ClientOptions options;
  options.timeout = std::chrono::milliseconds(250);
  ExpectError(Connect(options).RenderFrame(SomeRequest(0), &particles).status(),
              StatusCode::kDeadlineExceeded, {"timeout: 0.25 s", service_.address()});
}

TEST_F(ClientTest, LeavesTheServersOwnLimitOnTimeInItsWords) {
  service_.FailNext("GetServerInfo", {{grpc::StatusCode::DEADLINE_EXCEEDED, "frame: 31 s"}});
  const absl::Status status = Connect().GetServerInfo().status();
  EXPECT_EQ(status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_EQ(MessageOf(status), "frame: 31 s");
}

TEST_F(ClientTest, EndsWhenStopped) {
  service_.FailNext("GetServerInfo", std::vector(1000, kUnavailable));
  std::stop_source stop;
  ClientOptions options;
  options.max_attempts = 1000;
  options.stop = stop.get_token();
  Client client = Connect(options);
  const std::jthread stopper([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop.request_stop();
  });
  EXPECT_EQ(client.GetServerInfo().status().code(), StatusCode::kCancelled);
}

}  // namespace
}  // namespace halflight::client
