// Client::RenderSequence: frames are read, uploaded and asked for over one stream after another,
// each of which goes on where the one before it broke off.

#include <fmt/format.h>

#include <utility>

#include "client/client_impl.h"
#include "client/sequence_call.h"
#include "client/status_text.h"

namespace halflight::client {

absl::Status Client::Impl::RenderSequence(uint64_t count, const FrameSource& source,
                                          const FrameSink& sink, uint32_t read_ahead) {
  // All sets of a stream go where the first of all goes, which is therefore read beforehand.
  std::optional<absl::StatusOr<SequenceFrame>> first_frame;
  std::string route;
  if (count > 0) {
    first_frame = source(0);
    if (!first_frame->ok()) {
      return first_frame->status();
    }
    const SequenceFrame& frame = **first_frame;
    route = frame.particles ? frame.particles->sha256 : frame.request.scene().particle_sha256();
  }
  auto ask = [&](uint64_t index,
                 const std::stop_token& stop) -> absl::StatusOr<v1::RenderFrameRequest> {
    absl::StatusOr<SequenceFrame> frame =
        first_frame ? *std::exchange(first_frame, std::nullopt) : source(index);
    if (!frame.ok()) {
      return frame.status();
    }
    if (frame->particles) {
      if (absl::Status status = EnsureUploaded(*frame->particles, route, stop); !status.ok()) {
        return status;
      }
      frame->request.mutable_scene()->set_particle_sha256(frame->particles->sha256);
    }
    return std::move(frame->request);
  };

  SequenceRequests requests;
  uint64_t next = 0;
  uint64_t not_found_at = count;  // the frame for which particles were sent again
  int tries = 1;
  Backoff backoff(options_.first_backoff);
  while (next < count) {
    const SequenceStretch stretch{route, next, count, read_ahead};
    const SequenceOutcome outcome =
        RunSequenceStream(*channel_, options_, stretch, requests, ask, sink);
    const absl::Status& status = outcome.status;
    if (outcome.next == count) {
      break;  // however the stream ended: every frame is there, and whole
    }
    if (options_.stop.stop_requested()) {
      return absl::CancelledError("interrupted");
    }
    if (outcome.next > next) {
      tries = 1;
      backoff.Reset();
    }
    next = outcome.next;
    if (outcome.from_server && status.code() == absl::StatusCode::kNotFound &&
        not_found_at != next) {
      not_found_at = next;  // the set was dropped after it had been sent: send it again, once
      continue;
    }
    if (!outcome.from_server || !IsRetryable(status)) {
      return status;
    }
    if (++tries > options_.max_attempts) {
      return absl::Status(status.code(), fmt::format("{}, after {} tries: {}", address_, tries - 1,
                                                     MessageOf(status)));
    }
    if (!Pause(backoff.Next(RetryHint(status)), options_.stop)) {
      return absl::CancelledError("interrupted");
    }
  }
  return absl::OkStatus();
}

}  // namespace halflight::client
