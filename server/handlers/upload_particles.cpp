#include "server/handlers/upload_particles.h"

namespace halflight {

UploadParticlesHandler::UploadParticlesHandler(const Backend& backend)
    : upload_(backend.store, backend.partial_uploads, backend.limits) {}

std::optional<UploadParticlesHandler::Answer> UploadParticlesHandler::OnRequest(
    const v1::UploadParticlesRequest& request) {
  if (absl::Status status = upload_.Receive(request); !status.ok()) {
    return status;
  }
  // A set that is held already is answered at once: the client need not send the rest.
  // After finish the end of the stream is waited for, so that anything behind it is refused.
  if (upload_.response().has_value() && upload_.response()->already_present()) {
    return *upload_.response();
  }
  return std::nullopt;
}

UploadParticlesHandler::Answer UploadParticlesHandler::OnEndOfRequests() {
  if (absl::Status status = upload_.AtEndOfStream(); !status.ok()) {
    return status;
  }
  return *upload_.response();
}

}  // namespace halflight
