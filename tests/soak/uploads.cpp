// Uploads whose clients, or whose server, are killed: what had come is not sent again, and no set
// is ever another than its name says.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "client/client.h"
#include "halflight/sha256.h"
#include "halflight/v1/service.grpc.pb.h"
#include "tests/access/health.h"
#include "tests/process/wait_for.h"
#include "tests/server/made_particles.h"
#include "tests/server/upload_messages.h"
#include "tests/soak/cache_dir.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

namespace fs = std::filesystem;
using testing::Contents;
using testing::WaitFor;

// As upload_child makes them.
client::EncodedParticles Encoded(int particles) {
  const v1::InlineParticles set =
      testing::MakeParticles(particles, {v1::PARTICLE_ATTRIBUTE_POSITION});
  return {set.layout(), set.payload(), testing::Describe(set).sha256()};
}

v1::QueryUploadResponse Query(v1::RenderService::Stub& stub, const std::string& sha256) {
  grpc::ClientContext context;
  context.set_wait_for_ready(true);
  v1::QueryUploadRequest request;
  request.set_sha256(sha256);
  v1::QueryUploadResponse response;
  const grpc::Status status = stub.QueryUpload(&context, request, &response);
  Require(status.ok(), "QueryUpload: " + status.error_message());
  return response;
}

std::string FileOf(const std::string& cache, const std::string& sha256) {
  return cache + "/" + ToHex(sha256) + ".particles";
}

bool HasSets(const std::string& cache) {
  return std::any_of(fs::directory_iterator(cache), fs::directory_iterator(),
                     [](const auto& entry) { return entry.path().extension() == ".particles"; });
}

// Of its metrics: calls under way.
constexpr auto kUploads = R"(halflight_calls_in_progress{rpc="UploadParticles"})";

class Dice {
 public:
  explicit Dice(uint32_t seed) : random_(seed) {}

  size_t Below(size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random_); }

 private:
  std::mt19937 random_;
};

}  // namespace

void RunUploadClientsKilled(Run& run) {
  const testing::Folder folder;
  const std::string cache = folder / "cache";
  std::vector<std::string> flags = {"--cache-dir", cache};
  if (run.sabotage) {
    flags.insert(flags.end(), {"--partial-upload-seconds", "1"});
  }
  const Server server(folder, flags);
  auto client = client::Client::Connect(server.address());
  Require(client.status(), "connect");
  const auto stub = v1::RenderService::NewStub(
      grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials()));
  Dice dice(20263);
  const int kills = run.Of(200, 6);
  int killed = 0;
  size_t lost = 0;
  size_t corrupt = 0;
  uint64_t received = 0;
  for (int set = 0; killed < kills; ++set) {
    const int count = 200000 + set;  // 2.4 MB, a set of its own each time
    const client::EncodedParticles particles = Encoded(count);
    const uint64_t size = particles.payload.size();
    // Once or twice: the second goes on where the first was killed.
    uint64_t least = 0;
    for (size_t times = 1 + dice.Below(2); times > 0; --times) {
      testing::Process child(
          folder, "upload_child",
          {server.address(), std::to_string(count), std::to_string(1 + dice.Below(300000)),
           std::to_string(dice.Below(size))});
      Require(child.Wait() == -1, "it was to be killed: " + child.Err());
      ++killed;
      // What was received before is kept again, once the server knows that the client is gone.
      const auto kept = [&] {
        return server.Metric(kUploads) == 0.0 &&
               Query(*stub, particles.sha256).committed_bytes() >= least;
      };
      lost += WaitFor(kept, std::chrono::seconds(10)) ? 0 : 1;
      const v1::QueryUploadResponse there = Query(*stub, particles.sha256);
      Require(!there.complete() && there.committed_bytes() <= size, "part of a set, or none");
      least = there.committed_bytes();
    }
    if (run.sabotage) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    }
    // What was on its way when the client was killed may have come meanwhile.
    const uint64_t there = Query(*stub, particles.sha256).committed_bytes();
    lost += there >= least ? 0 : 1;
    received += std::max(there, least);
    Require(client->EnsureUploaded(particles), "the upload that goes on");
    Require(Query(*stub, particles.sha256).complete(), "the set is there");
    const std::string file = FileOf(cache, particles.sha256);
    Require(WaitFor([&] { return fs::exists(file); }), "its file");
    corrupt += Sha256Of(Contents(file)) == particles.sha256 ? 0 : 1;
  }
  const client::UploadTotals totals = client->upload_totals();
  run.report.AtLeast("clients killed in mid-upload", killed, kills, "");
  run.report.None("parts that the server had, and lost again", lost);
  run.report.Tell("bytes that had come before", static_cast<double>(received) * 1e-6, " MB");
  run.report.AtLeast("of these not sent again",
                     100.0 * static_cast<double>(totals.saved_bytes) /
                         static_cast<double>(std::max<uint64_t>(1, received)),
                     90, " %");
  run.report.None("sets on disk that are not what their name says", corrupt);
  run.report.Holds("serves afterwards", server.Serves());
}

void RunUploadServersKilled(Run& run) {
  const testing::Folder folder;
  const std::string address = "unix:" + folder / "socket";
  const std::string cache = folder / "cache";
  // Room for a few of the sets, so that whoever sends one after the other is always sending.
  const std::vector<std::string> flags = {"--address",
                                          address,
                                          "--cache-dir",
                                          cache,
                                          "--max-cache-dir-bytes",
                                          "8000000",
                                          "--max-particle-bytes",
                                          "2000000"};
  std::vector<client::EncodedParticles> sets;
  for (int i = 0; i < 40; ++i) {
    sets.push_back(Encoded(100000 + i));  // 1.2 MB
  }
  Dice dice(20264);
  const int kills = run.Of(200, 4);
  size_t whole = 0;
  size_t corrupt = 0;
  size_t others = 0;
  size_t while_sent = 0;
  for (int kill = 0; kill < kills; ++kill) {
    Server server(folder, flags);
    if (run.sabotage) {
      DamageAFile(cache);
      LeaveHalfAFile(cache);
    }
    for (const auto& entry : fs::directory_iterator(cache)) {
      const std::string name = entry.path().filename();
      if (entry.path().extension() != ".particles") {
        others += name == "halflightd.lock" ? 0 : 1;
      } else if (name == ToHex(Sha256Of(Contents(entry.path()))) + ".particles") {
        ++whole;
      } else {
        ++corrupt;
      }
    }
    std::stop_source gone;
    bool cut_off = false;
    std::jthread client_thread([&, first = dice.Below(sets.size())] {
      client::ClientOptions once;
      once.stop = gone.get_token();
      once.max_attempts = 1;
      auto client = client::Client::Connect(address, once);
      for (size_t i = first; !cut_off && !gone.stop_requested(); ++i) {
        cut_off = !client->EnsureUploaded(sets[i % sets.size()]).ok();
      }
    });
    if (kill % 2 == 0) {  // so that there is something to find, however slow the machine
      Require(WaitFor([&] { return HasSets(cache); }), "a set on disk");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(dice.Below(200)));
    server.Signal(SIGKILL);
    Require(server.Wait() == -1, "the server was to be killed");
    gone.request_stop();  // a call that has begun to connect would wait for its deadline
    client_thread.join();
    while_sent += cut_off ? 1 : 0;
  }

  // What is on disk is whole: each set is there, or sent again.
  std::vector<std::string> last_flags = flags;
  if (run.sabotage) {
    last_flags.insert(last_flags.end(), {"--device", "forgets"});
  }
  const Server server(folder, last_flags, run.sabotage ? "halflightd_broken" : "halflightd");
  const testing::Folder other_folder;
  const Server other(other_folder, {});  // that nothing happened to
  const auto stub = v1::RenderService::NewStub(testing::NewChannel(address));
  auto client = client::Client::Connect(address);
  Require(client.status(), "connect");
  auto other_client = client::Client::Connect(other.address());
  Require(other_client.status(), "connect");
  size_t held = 0;
  size_t drawn = 0;
  size_t different = 0;
  for (const client::EncodedParticles& set : sets) {
    held += Query(*stub, set.sha256).complete() ? 1 : 0;
  }
  for (const client::EncodedParticles& set : sets) {
    v1::RenderFrameRequest request = SweepOf(set.sha256, 32);
    request.mutable_scene()->mutable_material()->set_radius(0.001F);
    const auto frame = client->RenderFrame(request, &set);
    const auto expected = other_client->RenderFrame(request, &set);
    Require(expected.status(), "a frame of a server that was not killed");
    drawn += frame.ok() ? 1 : 0;
    different += frame.ok() && frame->outputs != expected->outputs ? 1 : 0;
  }
  run.report.Tell("servers killed", kills, "");
  run.report.AtLeast("of these while a set was being sent", static_cast<double>(while_sent),
                     0.9 * kills, "");
  run.report.AtLeast("whole sets found by those that followed", static_cast<double>(whole), 1, "");
  run.report.None("sets found that are not what their name says", corrupt);
  run.report.None("files left half written after a start", others);
  run.report.Tell("sets of 40 that the last server had", static_cast<double>(held), "");
  run.report.AtLeast("sets of 40 drawn, sent again where they were missing",
                     static_cast<double>(drawn), static_cast<double>(sets.size()), "");
  run.report.None("pictures that are others than of a server that was not killed", different);
}

}  // namespace halflight::soak
