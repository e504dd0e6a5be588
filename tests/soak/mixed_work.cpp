// What a day brings, for a quarter of an hour: uploads, frames, sequences, cancellations, errors.
// The server's memory must not grow.

#include <atomic>
#include <chrono>
#include <random>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "client/client.h"
#include "tests/access/health.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"
#include "tests/soak/statistics.h"

namespace halflight::soak {
namespace {

using std::chrono::milliseconds;

constexpr int kClients = 3;
// Of the sets that frames are drawn of.
constexpr size_t kSizes = 4;
constexpr uint32_t kSeeds = 8;

struct Work {
  std::atomic<size_t> frames = 0;
  std::atomic<size_t> sequences = 0;
  std::atomic<size_t> uploads = 0;
  std::atomic<size_t> cancelled = 0;
  std::atomic<size_t> errors = 0;      // that were asked for
  std::atomic<size_t> unexpected = 0;  // that were not
};

class Client {
 public:
  Client(const Server& server, uint32_t seed, Work& work)
      : server_(server),
        work_(work),
        random_(seed),
        channel_(testing::NewChannel(server.address())),
        client_(*client::Client::Connect(server.address())) {}

  void DoSomething() {
    switch (random_() % 10) {
      case 0:
        Sequence();
        break;
      case 1:
        UploadNewSet();
        break;
      case 2:
      case 3:
        CancelFrame();
        break;
      case 4:
        Fail();
        break;
      case 5:
        Reconnect();
        break;
      default:
        OneFrame();
    }
  }

  // How many connections there are shall not differ from rest to rest either.
  void Connect() { Require(testing::Health(channel_) == testing::kServing, "health at rest"); }

  // Of another connection. One that is let go of while it connects gRPC 1.51 keeps open in the
  // client, every so often, and the server has to keep its side of it: a hundred in twenty minutes
  // were 0.4 MiB.
  void Reconnect() {
    Connect();
    channel_ = testing::NewChannel(server_.address());
  }

  // What the server keeps of sets and of work on them is of what it was asked for last: of the same
  // then, whatever came before.
  void AskForAll() {
    for (size_t size = 0; size < kSizes; ++size) {
      for (uint32_t seed = 0; seed < kSeeds; ++seed) {
        const client::EncodedParticles particles = SetOf(size, seed);
        for (const v1::RenderFrameRequest& request :
             {FrameOf(particles.sha256, 64, 8), SweepOf(particles.sha256, 64)}) {
          Expect(client_.RenderFrame(request, &particles).ok(), work_.frames);
        }
      }
    }
  }

 private:
  static client::EncodedParticles SetOf(size_t size, uint32_t seed) {
    return BallOf(1000 + 500 * size, seed);
  }

  // Of one of a few sets, so that some are kept and some come back.
  client::EncodedParticles SomeSet() { return SetOf(random_() % kSizes, random_() % kSeeds); }

  v1::RenderFrameRequest SomeFrame(const std::string& sha256) {
    const int pixels = 32 * static_cast<int>(1 + random_() % 4);
    return random_() % 2 == 0 ? FrameOf(sha256, pixels, 8) : SweepOf(sha256, pixels);
  }

  void Expect(bool holds, std::atomic<size_t>& count) { ++(holds ? count : work_.unexpected); }

  void OneFrame() {
    const client::EncodedParticles particles = SomeSet();
    v1::RenderFrameRequest request = SomeFrame(particles.sha256);
    request.mutable_outputs(0)->set_format(static_cast<v1::ImageFormat>(1 + random_() % 5));
    Expect(client_.RenderFrame(request, &particles).ok(), work_.frames);
  }

  void Sequence() {
    const client::EncodedParticles particles = SomeSet();
    const v1::RenderFrameRequest request = SomeFrame(particles.sha256);
    const absl::Status status = client_.RenderSequence(
        4,
        [&](uint64_t) {
          return client::SequenceFrame{request, particles};
        },
        [](uint64_t, const client::RenderedFrame&) { return absl::OkStatus(); });
    Expect(status.ok(), work_.sequences);
  }

  void UploadNewSet() {
    Expect(client_.EnsureUploaded(BallOf(2000, random_())).ok(), work_.uploads);
  }

  void CancelFrame() {
    const client::EncodedParticles particles = SomeSet();
    const auto call = Call::Start(
        channel_,
        {.messages = {Bytes(SomeFrame(particles.sha256).SerializeAsString())}, .read_at_most = 1});
    std::this_thread::sleep_for(milliseconds(random_() % 20));
    call->Cancel();
    call->Wait();
    ++work_.cancelled;
  }

  void Fail() {
    v1::RenderFrameRequest request = FrameOf(std::string(32, 'x'), 64);
    if (random_() % 2 == 0) {
      request.mutable_scene()->mutable_camera()->set_width(1U << 30U);
    }
    const auto call = Call::Start(channel_, Ask(request));
    const grpc::StatusCode code = call->Wait().error_code();
    Expect(code == grpc::StatusCode::NOT_FOUND || code == grpc::StatusCode::INVALID_ARGUMENT,
           work_.errors);
  }

  const Server& server_;
  Work& work_;
  std::mt19937 random_;
  std::shared_ptr<grpc::Channel> channel_;
  client::Client client_;
};

// `seconds` of work by all clients at once.
void DoWork(std::vector<Client>& clients, std::chrono::duration<double> time) {
  std::vector<std::jthread> threads;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(time);
  for (Client& client : clients) {
    threads.emplace_back([&client, end] {
      while (Clock::now() < end) {
        client.DoSomething();
      }
    });
  }
}

}  // namespace

void RunMixedWork(Run& run) {
  const testing::Folder folder;
  // What is kept on purpose is full soon.
  std::vector<std::string> flags = {
      "--max-particle-bytes",  "1MiB", "--max-cache-bytes", "1MiB",
      "--max-reuse-bytes",     "1MiB", "--cache-dir",       folder / "cache",
      "--max-cache-dir-bytes", "1MiB"};
  if (run.sabotage) {
    flags.insert(flags.end(), {"--device", "leaks"});
  }
  const Server server(folder, flags, run.sabotage ? "halflightd_broken" : "halflightd");
  Work work;
  std::vector<Client> clients;
  for (uint32_t i = 0; i < kClients; ++i) {
    clients.emplace_back(server, i + 1, work);
  }
  // Work and rest by turns. What is left after a rest, when freed memory has gone back to the
  // system, is what the server holds; what it has while it works goes up and down by far more.
  const std::chrono::duration<double> turn(run.short_form ? 0.4 : 30.0);
  const int turns = run.Of(23, 8);
  const int warm = run.Of(5, 2);
  std::vector<Point> held;
  std::vector<Point> allocated;  // of it
  double connections = 0.0;
  const auto begin = Clock::now();
  for (int i = 0; i < turns; ++i) {
    DoWork(clients, turn);
    clients.front().AskForAll();
    for (Client& client : clients) {
      client.Connect();
    }
    if (!run.short_form) {
      server.Rest();
    }
    const std::chrono::duration<double, std::ratio<3600>> hours = Clock::now() - begin;
    const double megabytes = server.Megabytes();
    const double heap = server.Metric("process_heap_bytes").value_or(0.0) / (1 << 20);
    connections = server.Metric("halflight_connections").value_or(0.0);
    std::fprintf(stderr, "soak: turn %d, %.1f s: %.3f MiB, %.3f MiB allocated, %.0f connections\n",
                 i, hours.count() * 3600.0, megabytes, heap, connections);
    if (i >= warm) {
      held.push_back({hours.count(), megabytes});
      allocated.push_back({hours.count(), heap});
    }
  }
  const Slope slope = SlopeOf(held);
  const std::chrono::duration<double, std::ratio<60>> minutes = Clock::now() - begin;
  run.report.Tell("minutes, work and rests", minutes.count(), "");
  run.report.Tell("frames, sequences, uploads, cancelled, refused",
                  fmt::format("{}, {}, {}, {}, {}", work.frames.load(), work.sequences.load(),
                              work.uploads.load(), work.cancelled.load(), work.errors.load()));
  run.report.None("other errors", work.unexpected);
  run.report.AtMost("connections open at the end", connections, 2.0 * kClients, "");
  run.report.Tell("memory held at the end", held.back().y, " MiB");
  run.report.MemoryAtMost("memory more, from when it was warm", held.back().y - held.front().y,
                          run.Of(4, 40));
  if (!run.short_form || run.sabotage) {
    run.report.AtMost("memory more an hour, once warm", slope.value, 1, " MiB");
    run.report.Tell("the same, 95 % interval",
                    Digits(slope.low) + " to " + Digits(slope.high) + " MiB");
  }
  if (!run.short_form) {
    const Slope heap = SlopeOf(allocated);
    run.report.Tell("of it allocated and not freed, an hour", Digits(heap.value) + " MiB");
    run.report.Tell("the same of that, 95 % interval",
                    Digits(heap.low) + " to " + Digits(heap.high) + " MiB");
  }
  run.report.Holds("serves afterwards", server.Serves());
}

}  // namespace halflight::soak
