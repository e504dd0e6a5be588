#include "server/handlers/render_sequence.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include "server/error_detail.h"
#include "server/frame_log.h"
#include "server/log/log.h"
#include "server/status_text.h"

namespace halflight {

void RenderSequenceHandler::OnRequest(v1::RenderSequenceRequest request) {
  {
    const std::lock_guard lock(mutex_);
    AddSlot(request.frame().request_id());
    if (draining_) {
      Refuse(DrainingError());
    } else {
      waiting_.emplace().request = std::move(*request.mutable_frame());
      may_submit_ = true;
    }
  }
  Advance();
}

void RenderSequenceHandler::OnUnreadableRequest(const absl::Status& why) {
  {
    const std::lock_guard lock(mutex_);
    AddSlot("");
    Refuse(why);
  }
  Advance();
}

// Under the mutex: for what has been read. Frames that have no names of their own are numbered.
void RenderSequenceHandler::AddSlot(const std::string& request_id) {
  reading_ = false;
  Slot& slot = *slots_.emplace_back(std::make_shared<Slot>());
  slot.index = next_index_++;
  slot.name = request_id.empty() && !caller_.call_id.empty()
                  ? fmt::format("{}.{}", caller_.call_id, slot.index)
                  : request_id;
}

// Under the mutex: the last frame. The stream ends with it.
void RenderSequenceHandler::Refuse(const absl::Status& status) {
  Slot& slot = *slots_.back();
  Log(LogLevel::kInfo, "frame", RefusedFrameFields(slot.name, caller_, status));
  backend_.metrics.OnFrameRefused(caller_.tenant, status.code());
  slot.result = status;
  waiting_.reset();
  requests_ended_ = true;
}

// By the thread that advances, and nobody else touches the frame that waits meanwhile: hands it to
// the pipeline. Where its set is on disk alone, at first or because others pushed it out of memory,
// that is read first.
void RenderSequenceHandler::Submit() {
  const std::string sha256 = state_.SetWanted(waiting_->request.scene());
  std::unique_lock lock(mutex_);
  const std::shared_ptr<Slot> slot = slots_.back();
  lock.unlock();
  const absl::Status status = SubmitNow(slot);
  lock.lock();
  if (status.ok()) {
    waiting_.reset();
  } else if (absl::IsNotFound(status) && backend_.store.Touch(sha256)) {
    fetching_ = true;
    lock.unlock();
    backend_.store.Fetch(
        sha256, stop_.get_token(),
        [self = shared_from_this()](const absl::Status& fetched) { self->OnFetched(fetched); });
  } else if (waiting_->job.has_value()) {
    WaitOrRefuse(status);
  } else {
    Refuse(status);  // of particles that it carries, too: they found no room, so they do not stay
  }
}

absl::Status RenderSequenceHandler::SubmitNow(const std::shared_ptr<Slot>& slot) {
  if (!waiting_->job.has_value()) {
    auto job = state_.Next(waiting_->request);
    if (!job.ok()) {
      return job.status();
    }
    job->caller = caller_;
    job->request_id = slot->name;
    job->request.scene.particles.reset();
    waiting_ = Waiting{.request = {}, .job = *std::move(job)};
  }
  const auto particles = state_.Particles();
  if (!particles.ok()) {
    return particles.status();
  }
  FrameJob job = *waiting_->job;
  job.request.scene.particles = particles->set;
  return backend_.pipeline.Submit(std::move(job), stop_.get_token(),
                                  [self = shared_from_this(), slot](FrameOrError frame) {
                                    self->OnFrame(*slot, std::move(frame));
                                  });
}

// The set of the frame that waits was read, or is nowhere, or there is no room for it.
void RenderSequenceHandler::OnFetched(const absl::Status& fetched) {
  {
    const std::lock_guard lock(mutex_);
    fetching_ = false;
    if (fetched.ok()) {
      may_submit_ = true;
    } else if (!end_.has_value()) {
      WaitOrRefuse(fetched);
    }
  }
  Advance();
}

// Under the mutex. With frames of its own before it, or just sent, the stream tries again.
void RenderSequenceHandler::WaitOrRefuse(const absl::Status& status) {
  if (!absl::IsResourceExhausted(status) || (slots_.size() == 1 && !may_submit_)) {
    Refuse(status);
  }
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
