// Client::RenderSequence: one thread reads and uploads frames ahead and sends requests, the
// caller's takes frames; a stream that breaks off is opened again where it stopped.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <thread>
#include <utility>

#include "client/client_impl.h"
#include "client/frame_calls.h"
#include "client/frame_reader.h"
#include "client/readers/text.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

// How far sender and receiver of one stream are.
class Progress {
 public:
  explicit Progress(uint64_t first) : taken_(first) {}

  void FrameTaken() {
    const std::lock_guard lock(mutex_);
    ++taken_;
    ++signs_of_life_;
    changed_.notify_all();
  }
  void SignOfLife() {
    const std::lock_guard lock(mutex_);
    ++signs_of_life_;
    changed_.notify_all();
  }
  // Waits until fewer than `ahead` frames lie between `index` and the one awaited; false: stopped.
  bool WaitForTurn(uint64_t index, uint64_t ahead, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    return changed_.wait(lock, stop, [&] { return index - taken_ <= ahead; });
  }
  // Waits until nothing has happened for `timeout` (true), or until stopped (false).
  bool WaitForSilence(std::chrono::milliseconds timeout, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    uint64_t seen = signs_of_life_;
    while (changed_.wait_for(lock, stop, timeout, [&] { return signs_of_life_ != seen; })) {
      seen = signs_of_life_;
    }
    return !stop.stop_requested();
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  uint64_t taken_;  // also the index of the frame that is awaited
  uint64_t signs_of_life_ = 0;
};

// "frame 3: radius is 0" as (3, "radius is 0"); none for other messages.
std::optional<std::pair<uint64_t, std::string>> SplitFrameError(std::string_view message) {
  constexpr std::string_view kPrefix = "frame ";
  const size_t colon = message.find(": ");
  if (message.substr(0, kPrefix.size()) != kPrefix || colon == std::string_view::npos) {
    return std::nullopt;
  }
  const auto index = ParseCount(message.substr(kPrefix.size(), colon - kPrefix.size()));
  return index ? std::optional(std::pair(*index, std::string(message.substr(colon + 2))))
               : std::nullopt;
}

// How a stream ended.
struct Outcome {
  absl::Status status;
  bool from_server = true;  // said by the server or the connection to it, not by source or sink
};

// One stream, from frame `first` on.
class SequenceCall {
 public:
  // Sends frame `index`; a false `open` means that the stream takes no more.
  using SendFrame = std::function<absl::Status(uint64_t index, SequenceStream& stream,
                                               const std::stop_token&, bool& open)>;

  SequenceCall(grpc::ChannelInterface& channel, std::string_view route, const std::string& token,
               uint64_t first, uint64_t count)
      : first_(first), count_(count), next_(first), progress_(first) {
    SetMetadata(context_, route, token);
    stream_ = CallRenderSequence(channel, context_);
  }

  // Runs the stream to its end.
  Outcome Run(const SendFrame& send, const FrameSink& sink, uint32_t read_ahead,
              std::chrono::milliseconds timeout, const std::stop_token& stop) {
    const std::stop_callback cancel(stop, [this] { context_.TryCancel(); });
    std::jthread watchdog;
    if (timeout.count() > 0) {
      watchdog = std::jthread([this, timeout](const std::stop_token& stopped) {
        if (progress_.WaitForSilence(timeout, stopped)) {
          timed_out_ = true;
          context_.TryCancel();
        }
      });
    }
    absl::Status receive_error;
    {
      std::jthread sender([&](const std::stop_token& stopped) { Send(send, read_ahead, stopped); });
      receive_error = Receive(sink);
      if (!receive_error.ok()) {
        context_.TryCancel();
      }
    }
    absl::Status status = FromGrpc(stream_->Finish());
    if (!receive_error.ok()) {
      return {receive_error, false};
    }
    if (timed_out_) {
      return {absl::DeadlineExceededError(
          fmt::format("no sign of life for {} s, while frame {} was awaited",
                      static_cast<double>(timeout.count()) / 1000, next_))};
    }
    if (!status.ok()) {
      const std::string message(status.message());
      const auto split = SplitFrameError(message);
      return {split ? absl::Status(status.code(), fmt::format("frame {}: {}", first_ + split->first,
                                                              split->second))
                    : status};
    }
    if (!send_error_.ok()) {
      return {send_error_, false};
    }
    if (next_ < count_) {
      return {absl::DataLossError(
          fmt::format("the stream ended after {} of {} frames", next_, count_))};
    }
    return {absl::OkStatus()};
  }

  [[nodiscard]] uint64_t next() const { return next_; }
  [[nodiscard]] std::optional<std::chrono::milliseconds> retry_hint() const {
    return RetryHint(context_);
  }

 private:
  void Send(const SendFrame& send, uint64_t read_ahead, const std::stop_token& stopped) {
    bool open = true;
    for (uint64_t index = first_; open && index < count_; ++index) {
      if (!progress_.WaitForTurn(index, read_ahead, stopped)) {
        return;
      }
      absl::Status status = send(index, *stream_, stopped, open);
      if (stopped.stop_requested()) {
        return;  // the receiver knows why
      }
      if (!status.ok()) {
        send_error_ = std::move(status);  // the frames before this one still come
        break;
      }
      progress_.SignOfLife();
    }
    stream_->WritesDone();
  }

  absl::Status Receive(const FrameSink& sink) {
    grpc::ByteBuffer bytes;
    IncomingMessage<v1::RenderSequenceResponse> incoming;
    const v1::RenderSequenceResponse& message = incoming.message;
    FrameAssembler assembler;
    while (stream_->Read(&bytes)) {
      progress_.SignOfLife();
      if (absl::Status status = Read(bytes, incoming); !status.ok()) {
        return status;
      }
      if (message.frame_index() != next_ - first_) {
        return absl::DataLossError(fmt::format("frame {} came where frame {} was to come",
                                               first_ + message.frame_index(), next_));
      }
      absl::Status status;
      switch (message.part_case()) {
        case v1::RenderSequenceResponse::kHeader:
          status = assembler.AddHeader(message.header());
          break;
        case v1::RenderSequenceResponse::kChunk:
          status = assembler.AddChunk(message.chunk(), incoming.chunk_data);
          break;
        case v1::RenderSequenceResponse::kTrailer:
          status = assembler.AddTrailer(message.trailer());
          if (status.ok()) {
            status = sink(next_, assembler.Take());
          }
          if (status.ok()) {
            ++next_;
            progress_.FrameTaken();
          }
          break;
        default:
          break;  // a part that a later version of the service has added
      }
      if (!status.ok()) {
        return status;
      }
    }
    return absl::OkStatus();
  }

  uint64_t first_;
  uint64_t count_;
  uint64_t next_;
  Progress progress_;
  grpc::ClientContext context_;
  std::unique_ptr<SequenceStream> stream_;
  std::atomic<bool> timed_out_ = false;
  absl::Status send_error_;
};

}  // namespace

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
  auto send = [&](uint64_t index, SequenceStream& stream, const std::stop_token& stop,
                  bool& open) -> absl::Status {
    absl::StatusOr<SequenceFrame> frame =
        first_frame ? *std::exchange(first_frame, std::nullopt) : source(index);
    if (!frame.ok()) {
      return frame.status();
    }
    v1::RenderSequenceRequest request;
    *request.mutable_frame() = std::move(frame->request);
    if (frame->particles) {
      if (absl::Status status = EnsureUploaded(*frame->particles, route, stop); !status.ok()) {
        return status;
      }
      request.mutable_frame()->mutable_scene()->set_particle_sha256(frame->particles->sha256);
    }
    open = stream.Write(request);
    return absl::OkStatus();
  };

  uint64_t next = 0;
  uint64_t not_found_at = count;  // the frame for which particles were sent again
  int tries = 1;
  Backoff backoff(options_.first_backoff);
  while (next < count) {
    SequenceCall stream(*channel_, route, options_.security.token, next, count);
    const auto [status, from_server] =
        stream.Run(send, sink, read_ahead, options_.timeout, options_.stop);
    if (options_.stop.stop_requested()) {
      return absl::CancelledError("interrupted");
    }
    if (stream.next() > next) {
      tries = 1;
      backoff.Reset();
    }
    next = stream.next();
    if (status.ok()) {
      continue;
    }
    if (from_server && status.code() == absl::StatusCode::kNotFound && not_found_at != next) {
      not_found_at = next;  // the set was dropped after it had been sent: send it again, once
      continue;
    }
    if (!from_server || !IsRetryable(status)) {
      return status;
    }
    if (++tries > options_.max_attempts) {
      return absl::Status(status.code(), fmt::format("{}, after {} tries: {}", address_, tries - 1,
                                                     MessageOf(status)));
    }
    if (!Pause(backoff.Next(stream.retry_hint()), options_.stop)) {
      return absl::CancelledError("interrupted");
    }
  }
  return absl::OkStatus();
}

}  // namespace halflight::client
