// One stream of a sequence: a thread sends requests, the caller's takes frames.
// Leaves out opening another one where it breaks off, and what a frame is made of (sequence.cpp).
#pragma once

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/client.h"
#include "client/sequence_requests.h"

namespace halflight::client {

// The request of frame `index`, once the server has its particles.
using RequestSource = std::function<absl::StatusOr<v1::RenderFrameRequest>(
    uint64_t index, const std::stop_token& stop)>;

struct SequenceStretch {
  std::string_view route;
  uint64_t first;  // the frame with which the stream begins
  uint64_t count;  // of the sequence
  uint32_t read_ahead;
};

// How a stream ended.
struct SequenceOutcome {
  absl::Status status;
  bool from_server = true;  // said by the server or the connection to it, not by source or sink
  uint64_t next = 0;        // the first frame that was not taken
};

// Runs a stream to its end. `sink` is called on the caller's thread, `source` on another.
SequenceOutcome RunSequenceStream(grpc::ChannelInterface& channel, const ClientOptions& options,
                                  const SequenceStretch& stretch, SequenceRequests& requests,
                                  const RequestSource& source, const FrameSink& sink);

}  // namespace halflight::client
