#include "server/frame_queue.h"

#include <chrono>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "renderer/device_fault.h"
#include "server/error_detail.h"

namespace halflight {
namespace {

absl::Status FaultedError(int times) {
  return WithReason(
      absl::FailedPreconditionError(fmt::format(
          "the device has failed under this request {} times: this server does not draw it again",
          times)),
      v1::ERROR_REASON_FAULTED_TWICE);
}

// To what the engine has counted from when it was given the frame.
void AddWait(std::chrono::duration<double, std::milli> wait, std::vector<StageTiming>& timings) {
  if (timings.empty() || timings.front().stage != "queue") {
    timings.insert(timings.begin(), StageTiming{"queue"});
  }
  timings.front().milliseconds += wait.count();
}

}  // namespace

FrameQueue::FrameQueue(FrameEngine& engine, int at_once, std::function<Clock::time_point()> now)
    : engine_(engine), turns_(at_once, std::move(now)) {}

void FrameQueue::Push(QueuedFrame frame) {
  const auto kept = std::make_shared<QueuedFrame>(std::move(frame));
  turns_.Wait({.client = kept->client,
               .priority = kept->priority,
               .goes_on = kept->goes_on,
               .stop = kept->stop,
               .taken = [this, kept](const FairTurns::Turn& turn) { Give(kept, turn); },
               .cancelled = [kept] { kept->done(absl::CancelledError("frame cancelled")); }});
}

void FrameQueue::Give(const std::shared_ptr<QueuedFrame>& frame, const FairTurns::Turn& turn) {
  if (frame->begun) {
    frame->begun();
  }
  if (const absl::Status status = Submit(frame, turn); !status.ok()) {
    turns_.End(turn, [&] { frame->done(status); });
  }
}

absl::Status FrameQueue::Submit(const std::shared_ptr<QueuedFrame>& frame,
                                const FairTurns::Turn& turn) {
  const int faults = faulted_.Count(frame->fingerprint);
  if (faults >= FaultedRequests::kTooMany) {
    return FaultedError(faults);
  }
  frame->request.alone = faults > 0;  // so that no other is taken for the cause
  return engine_.Submit(std::move(frame->request), frame->stop,
                        [this, frame, turn](absl::StatusOr<FrameResult> result) {
                          if (IsSuspect(result.status())) {
                            faulted_.Blame(frame->fingerprint);
                          }
                          turns_.End(turn, [&] {
                            if (result.ok()) {
                              AddWait(turn.begin - turn.asked, result->timings);
                            }
                            frame->done(std::move(result));
                          });
                        });
}

}  // namespace halflight
