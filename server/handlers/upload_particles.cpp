#include "server/handlers/upload_particles.h"

#include <utility>

namespace halflight {

UploadParticlesHandler::UploadParticlesHandler(const Backend& backend, const Caller& caller)
    : metrics_(backend.metrics),
      upload_(backend.store, backend.partial_uploads, backend.limits, caller) {}

std::optional<UploadParticlesHandler::Answer> UploadParticlesHandler::OnRequest(
    const v1::UploadParticlesRequest& request) {
  absl::Status status = upload_.Receive(request);
  if (request.has_header() && !begun_) {
    begun_ = true;
    metrics_.OnUploadBegun(status.ok() && request.header().resume_offset() > 0);
  }
  if (!status.ok()) {
    return End(UploadEnd::kRefused, std::move(status));
  }
  // A set that is held already is answered at once: the client need not send the rest.
  // After finish the end of the stream is waited for, so that anything behind it is refused.
  if (upload_.response().has_value() && upload_.response()->already_present()) {
    return End(UploadEnd::kAlreadyPresent, *upload_.response());
  }
  return std::nullopt;
}

UploadParticlesHandler::Answer UploadParticlesHandler::OnUnreadableRequest(absl::Status why) {
  upload_.AtEndOfStream().IgnoreError();
  return End(UploadEnd::kRefused, std::move(why));
}

UploadParticlesHandler::Answer UploadParticlesHandler::OnEndOfRequests() {
  if (absl::Status status = upload_.AtEndOfStream(); !status.ok()) {
    return End(UploadEnd::kBrokenOff, std::move(status));
  }
  return End(UploadEnd::kCommitted, *upload_.response());
}

UploadParticlesHandler::Answer UploadParticlesHandler::End(UploadEnd end, Answer answer) {
  if (begun_) {
    metrics_.OnUploadEnd(end);
  }
  return answer;
}

}  // namespace halflight
