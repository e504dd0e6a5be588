#include "server/handlers/render_sequence.h"

#include <string>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/frame_log.h"
#include "server/retry_hint.h"

namespace halflight {
namespace {

absl::Status InFrame(uint64_t index, const absl::Status& status) {
  const absl::Status named(status.code(),
                           fmt::format("frame {}: {}", index, std::string(status.message())));
  return RetryHint(status).has_value() ? WithRetryHint(named) : named;
}

}  // namespace

void RenderSequenceHandler::OnRequest(const v1::RenderSequenceRequest& request) {
  auto slot = std::make_shared<Slot>();
  slot->index = next_index_++;
  {
    const std::lock_guard lock(mutex_);
    slots_.push_back(slot);
  }
  const absl::Status status = Submit(request.frame(), slot);
  {
    const std::lock_guard lock(mutex_);
    reading_ = false;
    if (!status.ok()) {
      slot->result = status;
      requests_ended_ = true;
    }
  }
  Advance();
}

absl::Status RenderSequenceHandler::Submit(const v1::RenderFrameRequest& request,
                                           const std::shared_ptr<Slot>& slot) {
  auto job = state_.Next(request, backend_);
  if (!job.ok()) {
    spdlog::info(RefusalLogLine(request.request_id(), job.status()));
    return job.status();
  }
  return backend_.pipeline.Submit(*std::move(job), stop_.get_token(),
                                  [self = shared_from_this(), slot](FrameOrError frame) {
                                    self->OnFrame(*slot, std::move(frame));
                                  });
}

void RenderSequenceHandler::OnEndOfRequests() {
  {
    const std::lock_guard lock(mutex_);
    reading_ = false;
    requests_ended_ = true;
  }
  Advance();
}

void RenderSequenceHandler::OnFrame(Slot& slot, FrameOrError result) {
  {
    const std::lock_guard lock(mutex_);
    slot.result = std::move(result);
  }
  Advance();
}

void RenderSequenceHandler::OnWritten(bool ok) {
  {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (!ok) {
      End(absl::CancelledError("the client is gone"));
    }
  }
  Advance();
}

void RenderSequenceHandler::OnCancel() {
  {
    const std::lock_guard lock(mutex_);
    End(absl::CancelledError("the call was cancelled"));
  }
  Advance();
}

// Under the mutex. The first reason to end stays.
void RenderSequenceHandler::End(const absl::Status& status) {
  stop_.request_stop();
  if (!end_.has_value()) {
    end_ = status;
  }
}

void RenderSequenceHandler::Advance() {
  while (true) {
    Step step = Step::kNothing;
    {
      const std::lock_guard lock(mutex_);
      if (advancing_) {
        return;  // whoever is at it looks again before leaving
      }
      step = NextStep();
      advancing_ = step != Step::kNothing;
    }
    switch (step) {
      case Step::kNothing:
        return;
      case Step::kRead:
        sink_.Read();
        break;
      case Step::kWrite:
        sink_.Write(message_);
        break;
      case Step::kFinish:
        // The last touch of the sink, and advancing_ stays: nobody steps any more.
        sink_.Finish(*end_);
        return;
    }
    const std::lock_guard lock(mutex_);
    advancing_ = false;
  }
}

// Under the mutex: what to do with the sink now.
RenderSequenceHandler::Step RenderSequenceHandler::NextStep() {
  if (finished_) {
    return Step::kNothing;
  }
  if (!end_.has_value() && !writing_ && !slots_.empty() && slots_.front()->result.has_value()) {
    const Slot& first = *slots_.front();
    if (!first.result->ok()) {
      End(InFrame(first.index, first.result->status()));
    } else {
      if (!messages_.has_value()) {
        messages_.emplace(**first.result);
      }
      message_.set_frame_index(first.index);
      if (messages_->Next(message_)) {
        writing_ = true;
        return Step::kWrite;
      }
      messages_.reset();
      slots_.pop_front();
      return NextStep();
    }
  }
  if (!end_.has_value() && requests_ended_ && slots_.empty() && !reading_) {
    end_ = absl::OkStatus();
  }
  if (end_.has_value()) {
    if (writing_) {
      return Step::kNothing;
    }
    finished_ = true;
    return Step::kFinish;
  }
  if (!reading_ && !requests_ended_ && slots_.size() < kFramesAhead) {
    reading_ = true;
    return Step::kRead;
  }
  return Step::kNothing;
}

}  // namespace halflight
