#include "client/cli/render_job.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <system_error>
#include <utility>

#include "client/cli/exit_code.h"
#include "client/cli/frame_pattern.h"
#include "client/cli/request_builder.h"
#include "client/cli/request_json.h"
#include "client/readers/reader.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

namespace fs = std::filesystem;

absl::Status Usage(const std::string& message) {
  return WithExitCode(absl::InvalidArgumentError(message), ExitCode::kUsage);
}

absl::StatusOr<v1::RenderFrameRequest> BuildRequest(const RenderOptions& options) {
  v1::RenderFrameRequest request;
  if (!options.scene_path.empty()) {
    std::ifstream file(options.scene_path, std::ios::binary);
    std::stringstream json;
    json << file.rdbuf();
    if (!file) {
      return Usage(
          fmt::format("--scene: {}: cannot be read: {}", options.scene_path, std::strerror(errno)));
    }
    auto parsed = ParseRequestJson(json.str());
    if (!parsed.ok()) {
      return Usage(fmt::format("--scene: {}: {}", options.scene_path, MessageOf(parsed.status())));
    }
    request = *std::move(parsed);
  }
  if (absl::Status status = ApplyFlags(options, request); !status.ok()) {
    return WithExitCode(status, ExitCode::kUsage);
  }
  return request;
}

absl::Status CheckNames(const RenderOptions& options, const v1::RenderFrameRequest& request) {
  const bool scene_has_particles = request.scene().particles_case() != v1::Scene::PARTICLES_NOT_SET;
  if (options.input.empty() && !scene_has_particles) {
    return Usage("input: is missing; allowed: a particle file, or a --scene that names particles");
  }
  if (options.input.empty() && !options.frames.empty()) {
    return Usage("--frames: is given; allowed: only with an input pattern");
  }
  if (options.outputs.empty() && !options.print_scene) {
    return Usage("--output: is missing; allowed: -o frame.png, or -o NAME=PATH");
  }
  if (options.frames.empty()) {
    const bool looks_like_pattern = CheckPattern(options.input).ok();
    if (looks_like_pattern && access(options.input.c_str(), F_OK) != 0) {
      return Usage(
          fmt::format("--frames: is missing for the input pattern '{}'; allowed: such as "
                      "24-40",
                      options.input));
    }
    return absl::OkStatus();
  }
  if (const absl::Status status = CheckPattern(options.input); !status.ok()) {
    return Usage(fmt::format("input: {}", MessageOf(status)));
  }
  for (const OutputFlag& output : options.outputs) {
    if (const absl::Status status = CheckPattern(output.path); !status.ok()) {
      return Usage(fmt::format("--output: {}", MessageOf(status)));
    }
  }
  return absl::OkStatus();
}

std::vector<JobFrame> NameFrames(const RenderOptions& options) {
  if (options.frames.empty()) {
    JobFrame frame{std::nullopt, options.input, {}};
    for (const OutputFlag& output : options.outputs) {
      frame.outputs.push_back(output.path);
    }
    return {frame};
  }
  std::vector<JobFrame> frames;
  for (const int64_t number : options.frames) {
    JobFrame frame{number, ExpandPattern(options.input, number), {}};
    for (const OutputFlag& output : options.outputs) {
      frame.outputs.push_back(ExpandPattern(output.path, number));
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

// One name for each file, however the path is written.
std::string NameOf(const std::string& path) {
  std::error_code error;
  const fs::path name = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? path : name.string();
}

// No two outputs in one file nor any in one that is read, and every input there, before anything is
// rendered.
absl::Status CheckFiles(const RenderOptions& options, const std::vector<JobFrame>& frames) {
  std::set<std::string> read;
  if (!options.scene_path.empty()) {
    read.insert(NameOf(options.scene_path));
  }
  for (const JobFrame& frame : frames) {
    if (!frame.input.empty()) {
      read.insert(NameOf(frame.input));
    }
  }
  std::set<std::string> written;
  std::string first_missing;
  size_t missing = 0;
  for (const JobFrame& frame : frames) {
    for (const std::string& path : frame.outputs) {
      const std::string name = NameOf(path);
      if (read.count(name) != 0) {
        return Usage(fmt::format("--output: '{}' is read too; allowed: another file", path));
      }
      if (!written.insert(name).second) {
        return Usage(fmt::format("--output: '{}' is written twice; allowed: once", path));
      }
    }
    if (!frame.input.empty() && access(frame.input.c_str(), R_OK) != 0) {
      if (missing++ == 0) {
        first_missing = fmt::format("{}: {}", frame.input, std::strerror(errno));
      }
    }
  }
  if (missing == 0) {
    return absl::OkStatus();
  }
  const std::string more =
      frames.size() > 1 ? fmt::format(" ({} of {} input files are missing)", missing, frames.size())
                        : "";
  return WithExitCode(absl::NotFoundError(first_missing + more), ExitCode::kInput);
}

}  // namespace

absl::StatusOr<Particles> ReadInput(const RenderOptions& options, const std::string& path) {
  auto particles = ReadParticles(path, options.format);
  if (!particles.ok()) {
    return WithExitCode(particles.status(), ExitCode::kInput);
  }
  if (options.radius) {
    particles->radii.clear();
  }
  if (options.opacity) {
    particles->opacities.clear();
  }
  if (options.emission) {
    particles->emissions.clear();
  }
  return particles;
}

absl::StatusOr<RenderJob> PlanRender(const RenderOptions& options) {
  auto request = BuildRequest(options);
  if (!request.ok()) {
    return request.status();
  }
  if (absl::Status status = CheckNames(options, *request); !status.ok()) {
    return status;
  }
  RenderJob job;
  job.request = *std::move(request);
  job.frames = NameFrames(options);
  if (absl::Status status = CheckFiles(options, job.frames); !status.ok()) {
    return status;
  }

  // Choose what is left open by the first frame, and by the last one, where the cloud has grown.
  std::optional<Particles> last_particles;
  std::vector<const Particles*> clouds;
  if (!options.input.empty()) {
    auto first = ReadInput(options, job.frames.front().input);
    if (!first.ok()) {
      return first.status();
    }
    clouds.push_back(&job.first_particles.emplace(*std::move(first)));
  }
  if (job.frames.size() > 1) {
    auto last = ReadInput(options, job.frames.back().input);
    if (!last.ok()) {
      return last.status();
    }
    clouds.push_back(&last_particles.emplace(*std::move(last)));
  }
  if (absl::Status status = FillInScene(clouds, job.request, job.choices); !status.ok()) {
    return WithExitCode(status, ExitCode::kUsage);
  }
  if (job.frames.size() > 1) {
    job.choices.push_back({"sequence",
                           "radius, camera and light are chosen once, from the first "
                           "and the last frame, and kept for all"});
  }
  return job;
}

}  // namespace halflight::client
