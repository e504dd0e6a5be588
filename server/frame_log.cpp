#include "server/frame_log.h"

#include <algorithm>

#include <fmt/format.h>

#include "server/convert/enums.h"
#include "server/error_detail.h"
#include "server/status_text.h"

namespace halflight {
namespace {

LogFields NameFields(const std::string& request_id, const Caller& caller) {
  LogFields fields = {{"request_id", request_id}};
  if (!caller.call_id.empty() && caller.call_id != request_id) {
    fields.emplace_back("call_id", caller.call_id);
  }
  if (!caller.tenant.empty()) {
    fields.emplace_back("tenant", caller.tenant);
  }
  if (!caller.peer.empty()) {
    fields.emplace_back("peer", caller.peer);
  }
  return fields;
}

void AddOutcome(LogFields& fields, const absl::Status& outcome) {
  fields.emplace_back("outcome", absl::StatusCodeToString(outcome.code()));
  if (const auto reason = DetailOf(outcome).reason; reason != v1::ERROR_REASON_UNSPECIFIED) {
    fields.emplace_back("reason", ReasonName(reason));
  }
  if (!outcome.ok()) {
    fields.emplace_back("message", MessageOf(outcome));
  }
}

}  // namespace

std::string StageKey(std::string stage) {
  std::replace(stage.begin(), stage.end(), ' ', '_');
  return stage;
}

LogFields FrameFields(const FrameJob& job, const MadeFrame& frame, const absl::Status& outcome) {
  const Scene& scene = job.request.scene;
  LogFields fields = NameFields(job.request_id, job.caller);
  fields.emplace_back("technique",
                      v1::ShadowTechnique_Name(ToProto(kTechniques, scene.shadow.technique)));
  fields.emplace_back("particles", scene.particles->size());
  fields.emplace_back("size",
                      fmt::format("{}x{}", scene.camera.window.width, scene.camera.window.height));
  fields.emplace_back("outputs", job.outputs.size());
  for (const StageTiming& timing : frame.rendered.timings) {
    fields.emplace_back(StageKey(timing.stage) + "_ms", timing.milliseconds);
  }
  if (frame.error.has_value()) {
    fields.emplace_back("relative_rmse", frame.error->relative_rmse.value);
  }
  if (frame.target.has_value()) {
    fields.emplace_back("attempts", frame.target->attempts.size());
    fields.emplace_back("target_met", frame.target->met);
  }
  AddOutcome(fields, outcome);
  return fields;
}

LogFields RefusedFrameFields(const std::string& request_id, const Caller& caller,
                             const absl::Status& outcome) {
  LogFields fields = NameFields(request_id, caller);
  AddOutcome(fields, outcome);
  return fields;
}

}  // namespace halflight
