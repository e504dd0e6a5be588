// What a sequence remembers from one request to the next, so that a request need only say what
// changes. Renders nothing.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "halflight/v1/service.pb.h"
#include "server/convert/convert_frame.h"
#include "server/handlers/backend.h"

namespace halflight {

class SequenceState {
 public:
  // The backend outlives the state. `client`: whose share of the memory for uploads particles are
  // held in that requests carry.
  explicit SequenceState(const Backend& backend, std::string client = "")
      : backend_(backend), inline_memory_(backend.partial_uploads.memory(), std::move(client)) {}

  // The job of the stream's next request, where each field of the scene that is unset, an unset
  // measure_error or target and empty outputs are those of the request before, and the frames share
  // what their targets have taught. Errors as for a single frame: NotFound too where a set that is
  // inherited was dropped by the store meanwhile, which a stream does not keep it from;
  // ResourceExhausted where there is no room for particles that it carries.
  absl::StatusOr<FrameJob> Next(const v1::RenderFrameRequest& request);

  // The particles of the last request that there was a job for, which need not hold them meanwhile:
  // the store may have dropped them, NotFound.
  absl::StatusOr<NamedParticles> Particles();

  // The name of the set in the store that a request with this scene is about; "" where there is
  // none.
  [[nodiscard]] const std::string& SetWanted(const v1::Scene& scene) const;

 private:
  // Of particles that a request carries: instead of those before.
  absl::Status Hold(NamedParticles brought);
  void LetGo();

  const Backend& backend_;
  v1::RenderFrameRequest merged_;         // of particles the name alone, where they are the store's
  std::optional<NamedParticles> inline_;  // those that a request brought
  ByteBudget::Share inline_memory_;
  std::shared_ptr<TargetKnowledge> knowledge_ = std::make_shared<TargetKnowledge>();
};

}  // namespace halflight
