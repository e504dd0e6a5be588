#include "server/handlers/render_frame.h"

#include <utility>

#include <spdlog/spdlog.h>

#include "server/convert/convert_frame.h"
#include "server/frame_log.h"

namespace halflight {

void RenderFrameHandler::Start(const v1::RenderFrameRequest& request) {
  if (const absl::Status status = Submit(request); !status.ok()) {
    spdlog::info(RefusalLogLine(request.request_id(), caller_, status));
    sink_.Finish(status);
  }
}

absl::Status RenderFrameHandler::Submit(const v1::RenderFrameRequest& request) {
  auto job = ConvertRequest(request, backend_.store, backend_.limits, backend_.device);
  if (!job.ok()) {
    return job.status();
  }
  job->caller = caller_;
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
    sink_.Finish(absl::OkStatus());
  }
}

}  // namespace halflight
