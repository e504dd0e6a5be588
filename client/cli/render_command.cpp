#include "client/cli/render_command.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <string_view>
#include <utility>

#include "client/cli/connection.h"
#include "client/cli/exit_code.h"
#include "client/cli/file_writer.h"
#include "client/cli/progress.h"
#include "client/cli/render_job.h"
#include "client/cli/report.h"
#include "client/cli/request_json.h"

namespace halflight::client {

namespace {

using SteadyClock = std::chrono::steady_clock;

// Takes rendered frames: writes their files and reports them.
class FrameTaker {
 public:
  FrameTaker(const RenderOptions& options, const RenderJob& job)
      : options_(options),
        job_(job),
        progress_(job.frames.size(), job.frames.size() > 1 && !options.quiet),
        last_(SteadyClock::now()) {}

  absl::Status Take(uint64_t index, const RenderedFrame& frame) {
    const JobFrame& job_frame = job_.frames[index];
    for (size_t i = 0; i < frame.outputs.size(); ++i) {
      if (absl::Status status = WriteFileWhole(job_frame.outputs[i], frame.outputs[i]);
          !status.ok()) {
        return WithExitCode(status, ExitCode::kOutput);
      }
    }
    const auto now = SteadyClock::now();
    const FrameReport report{
        job_frame.number, job_frame.input, job_frame.outputs,
        std::chrono::duration<double, std::milli>(now - std::exchange(last_, now)).count()};
    progress_.Clear();
    if (options_.json) {
      fmt::print("{}\n", FrameJson(report, frame, job_.request, job_.choices));
    } else if (!options_.quiet) {
      fmt::print("{}", FrameText(report, frame));
    }
    std::fflush(stdout);
    if (frame.header.has_target() && !frame.header.target().met() && misses_++ == 0) {
      first_miss_ = TargetMissText(frame.header.target());
      if (job_frame.number) {
        first_miss_ = fmt::format("frame {}: {}", *job_frame.number, first_miss_);
      }
    }
    taken_ = index + 1;
    progress_.Draw(taken_);
    return absl::OkStatus();
  }

  [[nodiscard]] uint64_t taken() const { return taken_; }

  // Of all frames, once they are written.
  [[nodiscard]] absl::Status TargetStatus() const {
    if (misses_ == 0) {
      return absl::OkStatus();
    }
    const std::string which =
        taken_ == 1 ? "" : fmt::format(" by {} of {} frames, first", misses_, taken_);
    return WithExitCode(
        absl::FailedPreconditionError(fmt::format(
            "the target was not met{}: {}; the best frame tried was written", which, first_miss_)),
        ExitCode::kTargetMissed);
  }

 private:
  const RenderOptions& options_;
  const RenderJob& job_;
  ProgressBar progress_;
  SteadyClock::time_point last_;
  uint64_t taken_ = 0;
  uint64_t misses_ = 0;
  std::string first_miss_;
};

absl::Status RenderSingle(const RenderJob& job, Client& client, FrameTaker& taker) {
  std::optional<EncodedParticles> particles;
  if (job.first_particles) {
    particles = EncodeParticles(*job.first_particles);
  }
  const auto frame = client.RenderFrame(job.request, particles ? &*particles : nullptr);
  return frame.ok() ? taker.Take(0, *frame) : frame.status();
}

absl::Status RenderFrames(const RenderOptions& options, const RenderJob& job, Client& client,
                          FrameTaker& taker) {
  auto source = [&](uint64_t index) -> absl::StatusOr<SequenceFrame> {
    const JobFrame& job_frame = job.frames[index];
    SequenceFrame frame{job.request, std::nullopt};
    if (index == 0 && job.first_particles) {
      frame.particles = EncodeParticles(*job.first_particles);
    } else if (const auto particles = ReadInput(options, job_frame.input); particles.ok()) {
      frame.particles = EncodeParticles(*particles);
    } else {
      return particles.status();
    }
    if (!job.request.request_id().empty()) {
      frame.request.set_request_id(
          fmt::format("{}.{}", job.request.request_id(), *job_frame.number));
    }
    return frame;
  };
  auto sink = [&taker](uint64_t index, const RenderedFrame& frame) {
    return taker.Take(index, frame);
  };
  absl::Status status = client.RenderSequence(job.frames.size(), source, sink);
  if (status.ok() || ExitCodeOf(status) == ExitCode::kInput || taker.taken() == job.frames.size()) {
    return status;
  }
  // The number that people know stands in for the stream's count.
  std::string message(status.message());
  const std::string prefix = fmt::format("frame {}: ", taker.taken());
  if (message.rfind(prefix, 0) == 0) {
    message.erase(0, prefix.size());
  }
  absl::Status named(status.code(),
                     fmt::format("{} of {} frames done; at {}: {}", taker.taken(),
                                 job.frames.size(), job.frames[taker.taken()].input, message));
  return WithExitCode(named, ExitCodeOf(status));
}

}  // namespace

absl::Status RunRender(const RenderOptions& options, const std::stop_token& stop) {
  const auto job = PlanRender(options);
  if (!job.ok()) {
    return job.status();
  }
  if (options.print_scene) {
    v1::RenderFrameRequest request = job->request;
    if (job->first_particles) {
      request.mutable_scene()->set_particle_sha256(EncodeParticles(*job->first_particles).sha256);
    }
    fmt::print("{}", RequestToJson(request));
    return absl::OkStatus();
  }
  for (const JobFrame& frame : job->frames) {
    for (const std::string& path : frame.outputs) {
      if (absl::Status status = PrepareDirectoryOf(path); !status.ok()) {
        return WithExitCode(status, ExitCode::kOutput);
      }
    }
  }
  if (!options.quiet && !options.json) {
    fmt::print("{}", ChoicesText(job->choices));
    std::fflush(stdout);
  }
  auto connection = Connection::Open(options.connection, stop);
  if (!connection.ok()) {
    return connection.status();
  }
  FrameTaker taker(options, *job);
  const absl::Status status = job->frames.size() > 1 || !options.frames.empty()
                                  ? RenderFrames(options, *job, connection->client(), taker)
                                  : RenderSingle(*job, connection->client(), taker);
  const UploadTotals uploads = connection->client().upload_totals();
  if (uploads.saved_bytes > 0 && !options.quiet && !options.json) {
    fmt::print("upload resumed: the server had {} bytes already, {} were sent\n",
               uploads.saved_bytes, uploads.sent_bytes);
  }
  return status.ok() ? taker.TargetStatus() : status;
}

}  // namespace halflight::client
