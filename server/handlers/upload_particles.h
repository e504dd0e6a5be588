// UploadParticles: feeds the stream's messages to an upload and answers once. What an upload is
// stands in particle_upload.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "halflight/v1/particles.pb.h"
#include "server/caller.h"
#include "server/handlers/backend.h"
#include "server/particle_upload.h"

namespace halflight {

// One thread at a time.
class UploadParticlesHandler {
 public:
  using Answer = absl::StatusOr<v1::UploadParticlesResponse>;

  // The backend's parts outlive the handler.
  explicit UploadParticlesHandler(const Backend& backend, const Caller& caller = {});

  // The next message: none to go on reading, or the answer that ends the call.
  std::optional<Answer> OnRequest(const v1::UploadParticlesRequest& request);

  // Instead, where what came cannot be taken for this reason: the answer. What came before is kept.
  Answer OnUnreadableRequest(absl::Status why);

  Answer OnEndOfRequests();

 private:
  // Counts how the upload ended, if it had begun.
  Answer End(UploadEnd end, Answer answer);

  Metrics& metrics_;
  bool begun_ = false;  // its header has arrived
  ParticleUpload upload_;
};

}  // namespace halflight
