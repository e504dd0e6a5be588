// What a sequence remembers from one request to the next, so that a request need only say what
// changes. Renders nothing.
#pragma once

#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "halflight/v1/service.pb.h"
#include "server/convert/convert_frame.h"
#include "server/handlers/backend.h"

namespace halflight {

class SequenceState {
 public:
  // The job of the stream's next request, where each field of the scene that is unset, an unset
  // measure_error or target and empty outputs are those of the request before, and the frames share
  // what their targets have taught. Errors as for a single frame.
  // The particles of the last request are kept alive here, even when the store drops them.
  absl::StatusOr<FrameJob> Next(const v1::RenderFrameRequest& request, const Backend& backend);

 private:
  v1::RenderFrameRequest merged_;  // without its particles
  std::optional<NamedParticles> particles_;
  std::shared_ptr<TargetKnowledge> knowledge_ = std::make_shared<TargetKnowledge>();
};

}  // namespace halflight
