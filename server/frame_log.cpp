#include "server/frame_log.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "server/convert/enums.h"

namespace halflight {
namespace {

// Between quotes, on one line, whatever a client wrote.
std::string Quoted(absl::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
    }
    const auto byte = static_cast<unsigned char>(c);
    quoted += byte < 0x20 || byte == 0x7f ? '?' : c;
  }
  return quoted + '"';
}

// Names of stages are for people; keys have no spaces.
std::string Key(std::string stage) {
  std::replace(stage.begin(), stage.end(), ' ', '_');
  return stage;
}

void AppendCaller(std::string& line, const Caller& caller) {
  for (const auto& [key, value] :
       {std::pair("tenant", &caller.tenant), std::pair("peer", &caller.peer)}) {
    if (!value->empty()) {
      fmt::format_to(std::back_inserter(line), " {}={}", key, Quoted(*value));
    }
  }
}

void AppendOutcome(std::string& line, const absl::Status& outcome) {
  fmt::format_to(std::back_inserter(line), " outcome={}", absl::StatusCodeToString(outcome.code()));
  if (!outcome.ok()) {
    fmt::format_to(std::back_inserter(line), " message={}", Quoted(outcome.message()));
  }
}

}  // namespace

std::string FrameLogLine(const FrameJob& job, const MadeFrame& frame, const absl::Status& outcome) {
  const Scene& scene = job.request.scene;
  std::string line = fmt::format("frame request_id={}", Quoted(job.request_id));
  AppendCaller(line, job.caller);
  fmt::format_to(std::back_inserter(line), " technique={} particles={} size={}x{} outputs={}",
                 v1::ShadowTechnique_Name(ToProto(kTechniques, scene.shadow.technique)),
                 scene.particles->size(), scene.camera.window.width, scene.camera.window.height,
                 job.outputs.size());
  for (const StageTiming& timing : frame.rendered.timings) {
    fmt::format_to(std::back_inserter(line), " {}_ms={:.2f}", Key(timing.stage),
                   timing.milliseconds);
  }
  if (frame.error.has_value()) {
    fmt::format_to(std::back_inserter(line), " relative_rmse={:.4g}",
                   frame.error->relative_rmse.value);
  }
  if (frame.target.has_value()) {
    fmt::format_to(std::back_inserter(line), " attempts={} target_met={}",
                   frame.target->attempts.size(), frame.target->met);
  }
  AppendOutcome(line, outcome);
  return line;
}

std::string RefusalLogLine(const std::string& request_id, const Caller& caller,
                           const absl::Status& outcome) {
  std::string line = fmt::format("frame request_id={}", Quoted(request_id));
  AppendCaller(line, caller);
  AppendOutcome(line, outcome);
  return line;
}

}  // namespace halflight
