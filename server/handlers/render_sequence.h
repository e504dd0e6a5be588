// RenderSequence: a stream of requests in, their frames out in the same order, a few requests
// ahead. What a request inherits from the one before stands in sequence_state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "halflight/v1/service.pb.h"
#include "server/caller.h"
#include "server/handlers/backend.h"
#include "server/handlers/frame_messages.h"
#include "server/handlers/sequence_state.h"
#include "server/handlers/sink.h"

namespace halflight {

// Requests of one stream that are rendered, or finished and not sent yet: enough to keep renderer,
// encoder and wire busy at once, and the bound on what a slow reader makes the server hold.
inline constexpr size_t kFramesAhead = 4;

// Held by the call, by the store while particles are read for it, and by the pipeline while frames
// of it are there: the sink has to live only until it is finished.
//
// Reads, writes and frames complete on different threads. Each notes what happened under the mutex
// and calls Advance, which lets one thread at a time do what follows, without the mutex: so the
// sink is never called by two at once, and never after Finish.
//
// A stream never fails because its own frames fill the queue, the memory for frames or that for
// particle sets: the next one then waits until they are sent.
class RenderSequenceHandler : public std::enable_shared_from_this<RenderSequenceHandler> {
 public:
  RenderSequenceHandler(const Backend& backend, DuplexSink<v1::RenderSequenceResponse>& sink,
                        Caller caller = {})
      : backend_(backend),
        sink_(sink),
        caller_(std::move(caller)),
        state_(backend_, caller_.client()) {}

  // Once, first.
  void Start() { Advance(); }
  void OnRequest(v1::RenderSequenceRequest request);
  // Instead, where what came cannot be taken for this reason: refused as a frame that asks for
  // nonsense is.
  void OnUnreadableRequest(const absl::Status& why);
  void OnEndOfRequests();
  // The server shuts down: what was accepted goes on, and the stream ends where it stands. Any
  // thread, any time.
  void OnDrain();
  // After each write; not ok: the peer is gone.
  void OnWritten(bool ok);
  // The client has cancelled, left, or run out of time. Any thread, any time.
  void OnCancel();

 private:
  using FrameOrError = absl::StatusOr<std::shared_ptr<const EncodedFrame>>;

  struct Slot {
    uint64_t index;    // in the stream
    std::string name;  // of the frame, in the log
    std::optional<FrameOrError> result;
  };

  // The frame of the last slot, until it is submitted.
  struct Waiting {
    v1::RenderFrameRequest request;  // empty once there is the job
    std::optional<FrameJob> job;     // without particles: who waits keeps no set from going
  };

  enum class Step : uint8_t { kNothing, kSubmit, kRead, kWrite, kFinish };

  void AddSlot(const std::string& request_id);
  void Refuse(const absl::Status& status);
  void Submit();
  absl::Status SubmitNow(const std::shared_ptr<Slot>& slot);
  void OnFetched(const absl::Status& fetched);
  void WaitOrRefuse(const absl::Status& status);
  void OnFrame(Slot& slot, FrameOrError result);
  void End(const absl::Status& status);
  void Advance();
  Step NextStep();

  const Backend backend_;
  DuplexSink<v1::RenderSequenceResponse>& sink_;
  const Caller caller_;
  std::stop_source stop_;

  SequenceState state_;  // touched only by the thread that submits a frame

  std::mutex mutex_;
  uint64_t next_index_ = 0;
  std::deque<std::shared_ptr<Slot>> slots_;  // in order; the first is being sent or waited for
  std::optional<Waiting> waiting_;
  bool may_submit_ = false;                // there may be room for it
  bool fetching_ = false;                  // its set is being read from disk
  std::optional<FrameMessages> messages_;  // of the first slot
  OutgoingMessage<v1::RenderSequenceResponse> outgoing_;
  std::optional<absl::Status> end_;  // what the call ends with
  bool reading_ = false;
  bool requests_ended_ = false;
  bool draining_ = false;
  bool writing_ = false;
  bool finished_ = false;
  bool advancing_ = false;
};

}  // namespace halflight
