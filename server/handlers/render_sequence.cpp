#include "server/handlers/render_sequence.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include "server/error_detail.h"
#include "server/frame_log.h"
#include "server/log/log.h"
#include "server/status_text.h"

namespace halflight {

void RenderSequenceHandler::OnRequest(const v1::RenderSequenceRequest& request) {
  const std::string& sha256 = state_.SetWanted(request.frame().scene());
  if (backend_.store.OnDiskOnly(sha256)) {
    // Until then the read counts as not done, so that no other begins.
    backend_.store.Fetch(sha256, stop_.get_token(),
                         [self = shared_from_this(), request](const absl::Status& fetched) {
                           self->Accept(request, fetched);
                         });
  } else {
    Accept(request, absl::OkStatus());
  }
}

void RenderSequenceHandler::Accept(const v1::RenderSequenceRequest& request,
                                   const absl::Status& fetched) {
  if (stop_.stop_requested()) {
    return;  // whoever did has ended the call
  }
  Take(fetched.ok() ? state_.Next(request.frame()) : fetched, request.frame().request_id());
}

void RenderSequenceHandler::OnUnreadableRequest(const absl::Status& why) { Take(why, ""); }

void RenderSequenceHandler::Take(absl::StatusOr<FrameJob> job, const std::string& request_id) {
  {
    const std::lock_guard lock(mutex_);
    reading_ = false;
    slots_.push_back(std::make_shared<Slot>());
    slots_.back()->index = next_index_++;
    if (draining_) {
      job = DrainingError();
    }
    if (job.ok()) {
      waiting_ = *std::move(job);
      waiting_->request.scene.particles.reset();  // a frame that waits keeps no set from going
      waiting_->caller = caller_;
      waiting_->request_id = FrameName(request_id, slots_.back()->index);
      may_submit_ = true;
    } else {
      Refuse(*slots_.back(), FrameName(request_id, slots_.back()->index), job.status());
    }
  }
  Advance();
}

// Frames that have no names of their own are numbered.
std::string RenderSequenceHandler::FrameName(const std::string& request_id, uint64_t index) const {
  return request_id.empty() && !caller_.call_id.empty()
             ? fmt::format("{}.{}", caller_.call_id, index)
             : request_id;
}

// Under the mutex. The stream ends with this frame.
void RenderSequenceHandler::Refuse(Slot& slot, const std::string& request_id,
                                   const absl::Status& status) {
  Log(LogLevel::kInfo, "frame", RefusedFrameFields(request_id, caller_, status));
  backend_.metrics.OnFrameRefused(caller_.tenant, status.code());
  slot.result = status;
  requests_ended_ = true;
}

// By the thread that advances: hands the frame that waits to the pipeline.
void RenderSequenceHandler::Submit() {
  std::unique_lock lock(mutex_);
  const std::shared_ptr<Slot> slot = slots_.back();
  FrameJob job = *waiting_;
  // Others may have pushed it out of memory meanwhile.
  const std::string& sha256 = state_.SetWanted({});
  if (backend_.store.OnDiskOnly(sha256)) {
    fetching_ = true;
    lock.unlock();
    backend_.store.Fetch(
        sha256, stop_.get_token(),
        [self = shared_from_this()](const absl::Status& fetched) { self->OnFetched(fetched); });
    return;
  }
  lock.unlock();
  const auto particles = state_.Particles();
  absl::Status status = particles.status();
  if (particles.ok()) {
    job.request.scene.particles = particles->set;
    status = backend_.pipeline.Submit(std::move(job), stop_.get_token(),
                                      [self = shared_from_this(), slot](FrameOrError frame) {
                                        self->OnFrame(*slot, std::move(frame));
                                      });
  }
  lock.lock();
  // With frames of its own before it, or just sent, the stream tries again.
  if (absl::IsResourceExhausted(status) && (slots_.size() > 1 || may_submit_)) {
    return;
  }
  if (!status.ok()) {
    Refuse(*slot, waiting_->request_id, status);
  }
  waiting_.reset();
}

// The set of the frame that waits is in memory or nowhere, or there is no room for it.
void RenderSequenceHandler::OnFetched(const absl::Status& fetched) {
  {
    const std::lock_guard lock(mutex_);
    fetching_ = false;
    may_submit_ = true;
    if (!fetched.ok() && !end_.has_value()) {
      Refuse(*slots_.back(), waiting_->request_id, fetched);
      waiting_.reset();
    }
  }
  Advance();
}

void RenderSequenceHandler::OnEndOfRequests() {
  {
    const std::lock_guard lock(mutex_);
    reading_ = false;
    requests_ended_ = true;
  }
  Advance();
}

void RenderSequenceHandler::OnDrain() {
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
  }
  Advance();
}

void RenderSequenceHandler::OnFrame(Slot& slot, FrameOrError result) {
  {
    const std::lock_guard lock(mutex_);
    slot.result = std::move(result);
    may_submit_ = true;
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
      case Step::kSubmit:
        Submit();
        break;
      case Step::kRead:
        sink_.Read();
        break;
      case Step::kWrite:
        sink_.Write(outgoing_);
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

// Under the mutex: what to do now.
RenderSequenceHandler::Step RenderSequenceHandler::NextStep() {
  if (finished_) {
    return Step::kNothing;
  }
  if (!end_.has_value() && !writing_ && !slots_.empty() && slots_.front()->result.has_value()) {
    const Slot& first = *slots_.front();
    if (!first.result->ok()) {
      End(Prefixed(fmt::format("frame {}: ", first.index), first.result->status()));
    } else {
      if (!messages_.has_value()) {
        messages_.emplace(**first.result);
      }
      outgoing_.message.set_frame_index(first.index);
      if (messages_->Next(outgoing_)) {
        writing_ = true;
        return Step::kWrite;
      }
      backend_.metrics.OnFrameSent(messages_->age());
      messages_.reset();
      slots_.front()->result.reset();  // whoever else has the slot shall hold no frame
      slots_.pop_front();
      may_submit_ = true;
      return NextStep();
    }
  }
  if (!end_.has_value() && requests_ended_ && slots_.empty() && !reading_) {
    end_ = absl::OkStatus();
  }
  if (!end_.has_value() && draining_ && slots_.empty()) {
    End(DrainingError());
  }
  if (end_.has_value()) {
    if (writing_) {
      return Step::kNothing;
    }
    finished_ = true;
    return Step::kFinish;
  }
  if (waiting_.has_value()) {
    return !fetching_ && std::exchange(may_submit_, false) ? Step::kSubmit : Step::kNothing;
  }
  if (!reading_ && !requests_ended_ && !draining_ && slots_.size() < kFramesAhead) {
    reading_ = true;
    return Step::kRead;
  }
  return Step::kNothing;
}

}  // namespace halflight
