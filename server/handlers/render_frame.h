// RenderFrame: one request in, one frame out, a message at a time as the peer takes them.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "halflight/v1/service.pb.h"
#include "server/caller.h"
#include "server/handlers/backend.h"
#include "server/handlers/frame_messages.h"
#include "server/handlers/sink.h"

namespace halflight {

// Held by the call, by the store while particles are read for it, and by the pipeline while its
// frame is there: the sink has to live only until it is finished.
class RenderFrameHandler : public std::enable_shared_from_this<RenderFrameHandler> {
 public:
  RenderFrameHandler(const Backend& backend, ResponseSink<v1::RenderFrameResponse>& sink,
                     Caller caller = {})
      : backend_(backend), sink_(sink), caller_(std::move(caller)) {}

  // Once, first.
  void Start(const v1::RenderFrameRequest& request);
  // After each write; not ok: the peer is gone.
  void OnWritten(bool ok);
  // The client has cancelled, left, or run out of time: stops the work, and the call then ends as
  // the pipeline or the next write reports. Any thread, any time.
  void OnCancel() { stop_.request_stop(); }

 private:
  // With whether there is a place for it, and again with what reading its particles came to.
  void Begin(const v1::RenderFrameRequest& request, absl::Status status);
  absl::Status Submit(const v1::RenderFrameRequest& request);
  void OnFrame(const absl::StatusOr<std::shared_ptr<const EncodedFrame>>& frame);
  void WriteNext();

  const Backend backend_;
  ResponseSink<v1::RenderFrameResponse>& sink_;
  const Caller caller_;
  std::stop_source stop_;
  // From here on touched by one thread at a time: each step of the call starts the next.
  std::optional<FrameMessages> messages_;
  OutgoingMessage<v1::RenderFrameResponse> outgoing_;
};

}  // namespace halflight
