#include "server/handlers/render_frame.h"

#include <string>
#include <utility>

#include "server/convert/convert_frame.h"

namespace halflight {

void RenderFrameHandler::Start(const v1::RenderFrameRequest& request) {
  // First: where more is asked for than can be drawn, refusing must cost little.
  Begin(request, backend_.pipeline.PlaceFor(caller_.client()));
}

void RenderFrameHandler::Begin(const v1::RenderFrameRequest& request, absl::Status status) {
  if (stop_.stop_requested()) {
    status = absl::CancelledError("the call was cancelled");
  } else if (status.ok()) {
    status = Submit(request);
  }
  const std::string& sha256 = request.scene().particle_sha256();
  if (absl::IsNotFound(status) && backend_.store.Touch(sha256)) {
    backend_.store.Fetch(sha256, stop_.get_token(),
                         [self = shared_from_this(), request](const absl::Status& fetched) {
                           self->Begin(request, fetched);
                         });
  } else if (!status.ok()) {
    backend_.metrics.OnFrameRefused(caller_.tenant, status.code());
    sink_.Finish(status);
  }
}

absl::Status RenderFrameHandler::Submit(const v1::RenderFrameRequest& request) {
  auto job = ConvertRequest(request, backend_.store, backend_.limits, backend_.device);
  if (!job.ok()) {
    return job.status();
  }
  job->caller = caller_;
  if (job->request_id.empty()) {
    job->request_id = caller_.call_id;
  }
  return backend_.pipeline.Submit(
      *std::move(job), stop_.get_token(),
      [self = shared_from_this()](const auto& frame) { self->OnFrame(frame); });
}

void RenderFrameHandler::OnFrame(const absl::StatusOr<std::shared_ptr<const EncodedFrame>>& frame) {
  if (!frame.ok()) {
    sink_.Finish(frame.status());
    return;
  }
  messages_.emplace(*frame);
  WriteNext();
}

void RenderFrameHandler::OnWritten(bool ok) {
  if (!ok) {
    sink_.Finish(absl::CancelledError("the client is gone"));
    return;
  }
  WriteNext();
}

void RenderFrameHandler::WriteNext() {
  if (messages_->Next(outgoing_)) {
    sink_.Write(outgoing_);
  } else {
    backend_.metrics.OnFrameSent(messages_->age());
    sink_.Finish(absl::OkStatus());
  }
}

}  // namespace halflight
