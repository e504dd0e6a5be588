#include "tests/bench/service.h"

#include <chrono>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/client.h"
#include "client/local_server.h"
#include "tests/bench/contestants.h"
#include "tests/loopback/wire_scene.h"
#include "tests/measure/plume_scene.h"
#include "tests/measure/timing.h"

namespace halflight::bench {
namespace {

// With the bounds.
constexpr double kRawOverInProcess = 1.15;
constexpr double kPngOverRaw = 1.30;

constexpr double kTurnStep = 3.0;  // degrees
constexpr uint64_t kSequenceFrames = 8;

using Clock = std::chrono::steady_clock;

double MillisecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

class ServiceBench {
 public:
  ServiceBench(FrameRenderer& renderer, client::Client client, const ParticleSet& plume,
               const MeasureOptions& options)
      : renderer_(renderer), client_(std::move(client)), plume_(plume), options_(options) {}

  absl::Status Run(Results& results) {
    if (absl::Status status = MeasureFirstFrames(results); !status.ok()) return status;
    if (absl::Status status = MeasureFollowingFrames(results); !status.ok()) return status;
    return MeasureSequences(results);
  }

 private:
  [[nodiscard]] size_t particles() const { return options_.short_form ? 8'192 : 65'536; }
  [[nodiscard]] int repeats(int most) const { return options_.short_form ? 1 : most; }

  [[nodiscard]] Scene SceneOf(uint32_t seed) const {
    const auto [width, height] = options_.short_form ? std::pair(96, 72) : std::pair(1280, 720);
    return Apply(DefaultPath(),
                 measure::PlumeScene(measure::Replicate(plume_, particles(), measure::kPlumeOpacity,
                                                        measure::kPlumeJitter, seed),
                                     measure::kSideLight, width, height));
  }

  static Row RowOf(const std::string& name, const Scene& scene) {
    Row row;
    row.name = name;
    row.particles = scene.particles->size();
    row.width = scene.camera.width;
    row.height = scene.camera.height;
    row.slices = scene.shadow.slices;
    return row;
  }

  static v1::RenderFrameRequest MessageOf(const Scene& scene, v1::ImageFormat format) {
    v1::RenderFrameRequest request = loopback::RequestWithoutParticles(scene);
    *request.add_outputs() = loopback::OutputOf(v1::OUTPUT_KIND_BEAUTY, format);
    return request;
  }

  // The same frames here and there in turns. Those over the wire name particles that the server
  // has, so that what differs is the service alone.
  struct Pair {
    Row here;
    Row there;
  };

  absl::Status MeasureBoth(const Scene& scene, const std::string& sha256, Pair& rows) {
    const FrameRequest request{scene, {{ImageKind::kBeauty}}};
    auto begin = Clock::now();
    const absl::StatusOr<FrameResult> drawn = renderer_.Render(request, {});
    rows.here.milliseconds.push_back(MillisecondsSince(begin));
    if (!drawn.ok()) return drawn.status();

    v1::RenderFrameRequest message = MessageOf(scene, v1::IMAGE_FORMAT_RAW_FLOAT);
    message.mutable_scene()->set_particle_sha256(sha256);
    begin = Clock::now();
    const auto received = client_.RenderFrame(std::move(message));
    rows.there.milliseconds.push_back(MillisecondsSince(begin));
    if (!received.ok()) return received.status();
    const std::vector<float>& pixels = drawn->images.at(0).pixels;
    const std::string& bytes = received->outputs.at(0);
    if (bytes.size() != pixels.size() * sizeof(float) ||
        std::memcmp(bytes.data(), pixels.data(), bytes.size()) != 0) {
      return absl::InternalError("service: its pixels differ from those drawn in process");
    }
    return absl::OkStatus();
  }

  // The first turn warms up.
  static void Report(const std::string& frames, Pair rows, Results& results) {
    for (Row* row : {&rows.here, &rows.there}) row->milliseconds.erase(row->milliseconds.begin());
    results.goals.push_back(
        {absl::StrCat("raw output over the service, times in process, ", frames),
         measure::MedianRatio(rows.there.milliseconds, rows.here.milliseconds), kRawOverInProcess,
         false, rows.there.name});
    results.service.push_back(std::move(rows.here));
    results.service.push_back(std::move(rows.there));
  }

  static Pair RowsOf(const std::string& frames, const Scene& scene) {
    return {RowOf(absl::StrCat("in process, ", frames), scene),
            RowOf(absl::StrCat("over a unix socket, raw floats, ", frames), scene)};
  }

  // Of particles that neither renderer has drawn before.
  absl::Status MeasureFirstFrames(Results& results) {
    Pair rows = RowsOf("first frames", SceneOf(1));
    for (int turn = 0; turn <= repeats(15); ++turn) {
      const Scene scene = SceneOf(++seed_);
      const client::EncodedParticles particles = loopback::Encoded(*scene.particles);
      if (absl::Status status = client_.EnsureUploaded(particles); !status.ok()) return status;
      if (absl::Status status = MeasureBoth(scene, particles.sha256, rows); !status.ok()) {
        return status;
      }
    }
    Report("first frames", std::move(rows), results);
    return absl::OkStatus();
  }

  // Of the same particles from ever new sides.
  absl::Status MeasureFollowingFrames(Results& results) {
    Scene scene = SceneOf(1);
    const client::EncodedParticles particles = loopback::Encoded(*scene.particles);
    if (absl::Status status = client_.EnsureUploaded(particles); !status.ok()) return status;
    Pair rows = RowsOf("following frames", scene);
    for (int turn = 0; turn <= repeats(15); ++turn) {
      scene.camera =
          measure::PlumeCamera(scene.camera.width, scene.camera.height, kTurnStep * turn);
      if (absl::Status status = MeasureBoth(scene, particles.sha256, rows); !status.ok()) {
        return status;
      }
    }
    Report("following frames", std::move(rows), results);
    return absl::OkStatus();
  }

  // Milliseconds a frame, of a sequence of particles never seen before.
  absl::StatusOr<double> TimeSequence(v1::ImageFormat format) {
    std::vector<client::SequenceFrame> frames;
    for (uint64_t i = 0; i < kSequenceFrames; ++i) {
      const Scene scene = SceneOf(++seed_);
      frames.push_back({MessageOf(scene, format), loopback::Encoded(*scene.particles)});
    }
    const auto begin = Clock::now();
    const absl::Status status = client_.RenderSequence(
        kSequenceFrames, [&](uint64_t index) { return frames[index]; },
        [](uint64_t, const client::RenderedFrame&) { return absl::OkStatus(); });
    if (!status.ok()) return status;
    return MillisecondsSince(begin) / static_cast<double>(kSequenceFrames);
  }

  absl::Status MeasureSequences(Results& results) {
    const Scene scene = SceneOf(1);
    Row raw = RowOf("sequence, raw floats", scene);
    Row png = RowOf("sequence, PNG", scene);
    for (int turn = 0; turn <= repeats(7); ++turn) {
      for (const auto& [row, format] :
           {std::pair(&raw, v1::IMAGE_FORMAT_RAW_FLOAT), std::pair(&png, v1::IMAGE_FORMAT_PNG8)}) {
        const absl::StatusOr<double> milliseconds = TimeSequence(format);
        if (!milliseconds.ok()) return milliseconds.status();
        if (turn > 0) row->milliseconds.push_back(*milliseconds);
      }
    }
    results.goals.push_back({"PNG in a sequence, times raw output",
                             measure::MedianRatio(png.milliseconds, raw.milliseconds), kPngOverRaw,
                             false, png.name});
    results.service.push_back(std::move(raw));
    results.service.push_back(std::move(png));
    return absl::OkStatus();
  }

  FrameRenderer& renderer_;
  client::Client client_;
  const ParticleSet& plume_;
  const MeasureOptions& options_;
  uint32_t seed_ = 1;
};

}  // namespace

absl::Status MeasureService(FrameRenderer& renderer, const MeasureOptions& options,
                            Results& results) {
  const auto plume = measure::LoadPlumeFrame(options.data_folder, "0040");
  if (!plume.ok()) return plume.status();
  client::LocalServerOptions server_options;
  server_options.device = options.device;
  const auto server = client::LocalServer::Start(server_options);
  if (!server.ok()) return server.status();
  absl::StatusOr<client::Client> client = client::Client::Connect(server->address());
  if (!client.ok()) return client.status();
  return ServiceBench(renderer, *std::move(client), **plume, options).Run(results);
}

}  // namespace halflight::bench
