// Where handlers send their answers: what a gRPC reactor does, without gRPC, so that handlers are
// tested without sockets.
#pragma once

#include "absl/status/status.h"
#include "server/encode/shared_bytes.h"

namespace halflight {

// A message to send. The data of its chunk stays out of it, where it lies, so that a frame on its
// way is held once, however many chunks of it are.
template <typename Response>
struct OutgoingMessage {
  Response message;
  SharedBytes chunk_data;  // what message.chunk().data() stands for, which is empty
};

// One call's way back. A handler keeps at most one write under way, and does not touch the sink
// after Finish. Each may answer before it returns.
template <typename Response>
class ResponseSink {
 public:
  virtual ~ResponseSink() = default;

  // Sends one message, which stays unchanged until the handler's OnWritten is called.
  virtual void Write(const OutgoingMessage<Response>& outgoing) = 0;

  // Ends the call. Not while a write is under way; a read may be.
  virtual void Finish(const absl::Status& status) = 0;
};

// With a stream of requests as well.
template <typename Response>
class DuplexSink : public ResponseSink<Response> {
 public:
  // Asks for the next request: the handler's OnRequest, OnUnreadableRequest or OnEndOfRequests
  // follows. One at a time.
  virtual void Read() = 0;
};

}  // namespace halflight
