// Uploads across processes that are killed: clients at random offsets, and the server, with a cache
// directory, at random moments. HALFLIGHT_UPLOAD_LONG=1 in the environment kills each 200 times.

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <random>
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

int Kills() {
  const char* const is_long = std::getenv("HALFLIGHT_UPLOAD_LONG");
  return is_long != nullptr && std::string(is_long) == "1" ? 200 : 10;
}

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

  size_t Below(size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random_); }

  const testing::Folder folder_;
  std::mt19937 random_{20263};
};

TEST_F(Killed, ClientsAtAnyOffsetLeaveAnUploadThatGoesOn) {
  const std::string address = "unix:" + folder_ / "socket";
  const Process server(folder_, "halflightd_fake",
                       {"--address", address, "--cache-dir", folder_ / "cache"});
  ASSERT_EQ(server.Address(), address);
  auto client = client::Client::Connect(address);
  ASSERT_TRUE(client.ok());
  for (int kill = 0; kill < Kills(); ++kill) {
    const int count = 200000 + kill;  // 2.4 MB, a set of its own each time
    const client::EncodedParticles particles = Encoded(count);
    const uint64_t size = particles.payload.size();
    // Once or twice: the second goes on where the first was killed.
    uint64_t least = 0;
    for (size_t times = 1 + Below(2); times > 0; --times) {
      const size_t chunk = 1 + Below(300000);
      const uint64_t die_at = Below(size);
      Process child(
          folder_, "upload_child",
          {address, std::to_string(count), std::to_string(chunk), std::to_string(die_at)});
      EXPECT_EQ(child.Wait(), -1) << "it was to be killed: " << child.Err();
      // What was received before is kept again, once the server knows that the client is gone.
      ASSERT_TRUE(
          WaitFor([&] { return Query(address, particles.sha256).committed_bytes() >= least; }));
      const v1::QueryUploadResponse there = Query(address, particles.sha256);
      EXPECT_FALSE(there.complete());
      EXPECT_LE(there.committed_bytes(), size);
      least = there.committed_bytes();
    }
    const absl::Status status = client->EnsureUploaded(particles);
    ASSERT_TRUE(status.ok()) << status;
    ASSERT_TRUE(Query(address, particles.sha256).complete());
    const std::string file = folder_ / "cache/" + ToHex(particles.sha256) + ".particles";
    ASSERT_TRUE(WaitFor([&] { return fs::exists(file); }));
    EXPECT_EQ(Sha256Of(Contents(file)), particles.sha256);
  }
  const client::UploadTotals totals = client->upload_totals();
  std::cout << "killed " << Kills() << " clients: " << totals.sent_bytes << " bytes sent again, "
            << totals.saved_bytes << " saved\n";
  EXPECT_GT(totals.saved_bytes, 0U);
}

TEST_F(Killed, ServerAtAnyMomentLeavesWholeSetsOrNone) {
  const std::string address = "unix:" + folder_ / "socket";
  const std::string cache = folder_ / "cache";
  client::ClientOptions options;
  options.max_attempts = 1000;
  options.first_backoff = std::chrono::milliseconds(10);
  std::vector<client::EncodedParticles> sets;
  for (int i = 0; i < 6; ++i) {
    sets.push_back(Encoded(100000 + i));
  }
  int found = 0;
  for (int kill = 0; kill < Kills(); ++kill) {
    Process server(folder_, "halflightd_fake", {"--address", address, "--cache-dir", cache});
    ASSERT_EQ(server.Address(), address);
    // Files of sets are whole, and nothing else of theirs is left.
    for (const auto& entry : fs::directory_iterator(cache)) {
      const std::string name = entry.path().filename();
      if (name != "halflightd.lock") {
        ++found;
        EXPECT_EQ(name, ToHex(Sha256Of(Contents(entry.path()))) + ".particles");
      }
    }
    std::jthread client_thread([&, order = Below(sets.size())] {
      client::ClientOptions once;
      once.timeout = std::chrono::seconds(1);
      once.max_attempts = 1;
      auto client = client::Client::Connect(address, once);
      for (size_t i = 0; i < sets.size(); ++i) {
        client->EnsureUploaded(sets[(i + order) % sets.size()]).IgnoreError();
      }
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(Below(200)));
    server.Signal(SIGKILL);
    EXPECT_EQ(server.Wait(), -1);
    client_thread.join();
    // So that there is always something to write.
    fs::remove(cache + "/" + ToHex(sets[Below(sets.size())].sha256) + ".particles");
  }
  std::cout << "killed the server " << Kills() << " times: found " << found << " whole sets\n";
  EXPECT_GT(found, 0);

  // A client that retries rides over a kill and a restart.
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
