// Uploads across restarts of the server, and kills, with a cache directory. Kills by the hundred
// are the soak's: tests/soak/uploads.cpp.

#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "client/client.h"
#include "halflight/sha256.h"
#include "halflight/v1/service.grpc.pb.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/server/fake_engine.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using testing::Contents;
using testing::Describe;
using ::testing::HasSubstr;
using testing::MakeParticles;
using testing::Process;
using testing::WaitFor;

v1::InlineParticles SetOf(int particles) {
  return MakeParticles(particles, {v1::PARTICLE_ATTRIBUTE_POSITION});
}

// Renders sets that have no radius of their own.
v1::RenderFrameRequest Request() {
  v1::RenderFrameRequest request = testing::MakeRequest();
  request.mutable_scene()->mutable_material()->set_radius(0.1F);
  return request;
}

client::EncodedParticles Encoded(int particles) {
  const v1::InlineParticles set = SetOf(particles);
  return {set.layout(), set.payload(), Describe(set).sha256()};
}

class Killed : public ::testing::Test {
 protected:
  static v1::QueryUploadResponse Query(const std::string& address, const std::string& sha256) {
    const auto stub = v1::RenderService::NewStub(
        grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    v1::QueryUploadRequest request;
    request.set_sha256(sha256);
    v1::QueryUploadResponse response;
    const grpc::Status status = stub->QueryUpload(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }

  const testing::Folder folder_;
};

TEST_F(Killed, ServerHasWhatItHadAndItsClientsRideOverIt) {
  const std::string address = "unix:" + folder_ / "socket";
  const std::string cache = folder_ / "cache";
  client::ClientOptions options;
  options.max_attempts = 1000;
  options.first_backoff = std::chrono::milliseconds(10);
  std::optional<Process> server;
  server.emplace(folder_, "halflightd_fake",
                 std::vector<std::string>{"--address", address, "--cache-dir", cache});
  ASSERT_EQ(server->Address(), address);
  const client::EncodedParticles large = Encoded(2000000);
  absl::Status status;
  std::jthread client_thread([&] {
    auto client = client::Client::Connect(address, options);
    status = client->EnsureUploaded(large);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  server->Signal(SIGKILL);
  EXPECT_EQ(server->Wait(), -1);
  server.emplace(folder_, "halflightd_fake",
                 std::vector<std::string>{"--address", address, "--cache-dir", cache});
  client_thread.join();
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_TRUE(Query(address, large.sha256).complete());

  // What is on disk is rendered after a restart, by one call and by a stream of them.
  ASSERT_TRUE(
      WaitFor([&] { return fs::exists(cache + "/" + ToHex(large.sha256) + ".particles"); }));
  server->Signal(SIGTERM);
  EXPECT_EQ(server->Wait(), 0) << server->Err();
  for (const bool sequence : {false, true}) {
    Process restarted(folder_, "halflightd_fake", {"--address", address, "--cache-dir", cache});
    auto client = client::Client::Connect(address, options);
    v1::RenderFrameRequest request = Request();
    request.mutable_scene()->set_particle_sha256(large.sha256);
    if (sequence) {
      status = client->RenderSequence(
          3,
          [&](uint64_t) {
            return client::SequenceFrame{request, std::nullopt};
          },
          [](uint64_t, const client::RenderedFrame&) { return absl::OkStatus(); });
    } else {
      const auto frame = client->RenderFrame(request);
      status = frame.status();
    }
    EXPECT_TRUE(status.ok()) << status;
    restarted.Signal(SIGTERM);
    EXPECT_EQ(restarted.Wait(), 0) << restarted.Err();
  }
}

TEST_F(Killed, DamagedSetIsSentAgainByTheClientWithoutAWord) {
  const std::string address = "unix:" + folder_ / "socket";
  const std::vector<std::string> flags = {"--address", address, "--cache-dir", folder_ / "cache"};
  const client::EncodedParticles particles = Encoded(1000);
  const std::string file = folder_ / "cache/" + ToHex(particles.sha256) + ".particles";
  {
    Process server(folder_, "halflightd_fake", flags);
    ASSERT_EQ(server.Address(), address);
    ASSERT_TRUE(client::Client::Connect(address)->EnsureUploaded(particles).ok());
    server.Signal(SIGTERM);
    EXPECT_EQ(server.Wait(), 0) << server.Err();
  }
  std::string bytes = Contents(file);
  ASSERT_EQ(bytes.size(), 12040U) << "what waits is written before a server that is told to ends";
  bytes[5000] = static_cast<char>(bytes[5000] ^ 1);
  ASSERT_EQ(folder_.Write("cache/" + ToHex(particles.sha256) + ".particles", bytes), file);
  const Process server(folder_, "halflightd_fake", flags);
  ASSERT_EQ(server.Address(), address);
  auto client = client::Client::Connect(address);
  const auto frame = client->RenderFrame(Request(), &particles);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_THAT(server.Err(), HasSubstr("message=\"its SHA-256 is"));
  EXPECT_EQ(client->upload_totals().sent_bytes, 12000U);
  EXPECT_TRUE(WaitFor([&] { return Sha256Of(Contents(file)) == particles.sha256; }));
}

TEST_F(Killed, ServerSaysWhyItCannotUseItsCacheDirectory) {
  const std::string cache = folder_ / "cache";
  const Process first(folder_, "halflightd_fake",
                      {"--address", "127.0.0.1:0", "--cache-dir", cache});
  ASSERT_FALSE(first.Address().empty());
  struct Case {
    std::vector<std::string> flags;
    int code;
    std::string text;
  };
  for (const Case& wrong :
       {Case{{"--cache-dir", cache}, 1, "--cache-dir " + cache + ": another server uses it"},
        Case{{"--cache-dir", "/proc/nothing"}, 1, "--cache-dir /proc/nothing: cannot be made"},
        Case{{"--cache-dir", folder_.Write("file", "")}, 1, "/file: cannot be opened"},
        Case{{"--max-cache-dir-bytes", "1GiB"}, 2, "--cache-dir"}}) {
    std::vector<std::string> flags = {"--address", "127.0.0.1:0"};
    flags.insert(flags.end(), wrong.flags.begin(), wrong.flags.end());
    Process server(folder_, "halflightd_fake", flags);
    EXPECT_EQ(server.Wait(), wrong.code) << server.Err();
    EXPECT_THAT(server.Err(), HasSubstr(wrong.text));
  }
}

}  // namespace
}  // namespace halflight
