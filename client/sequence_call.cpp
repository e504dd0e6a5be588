#include "client/sequence_call.h"

#include <fmt/format.h>

#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
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
  // Between these the server is not waited for; may be nested.
  void BeginOwnWork() {
    const std::lock_guard lock(mutex_);
    ++own_work_;
    ++signs_of_life_;
    changed_.notify_all();
  }
  void EndOwnWork() {
    const std::lock_guard lock(mutex_);
    --own_work_;
    ++signs_of_life_;
    changed_.notify_all();
  }
  // Waits until nothing has happened for `timeout` (true), or until stopped (false).
  bool WaitForSilence(std::chrono::milliseconds timeout, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    uint64_t seen = 0;
    do {
      changed_.wait(lock, stop, [&] { return own_work_ == 0; });
      seen = signs_of_life_;
    } while (changed_.wait_for(lock, stop, timeout, [&] { return signs_of_life_ != seen; }));
    return !stop.stop_requested();
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  uint64_t taken_;  // also the index of the frame that is awaited
  uint64_t signs_of_life_ = 0;
  int own_work_ = 0;
};

// The time in which source or sink works is not the server's silence.
class OwnWork {
 public:
  explicit OwnWork(Progress& progress) : progress_(progress) { progress_.BeginOwnWork(); }
  OwnWork(const OwnWork&) = delete;
  OwnWork& operator=(const OwnWork&) = delete;
  ~OwnWork() { progress_.EndOwnWork(); }

 private:
  Progress& progress_;
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

class SequenceCall {
 public:
  SequenceCall(grpc::ChannelInterface& channel, const ClientOptions& options,
               const SequenceStretch& stretch, SequenceRequests& requests)
      : options_(options),
        stretch_(stretch),
        requests_(requests),
        next_(stretch.first),
        sent_(stretch.first),
        progress_(stretch.first) {
    SetMetadata(context_, stretch.route, options.security.token);
    stream_ = CallRenderSequence(channel, context_);
  }

  SequenceOutcome Run(const RequestSource& source, const FrameSink& sink) {
    const std::stop_callback cancel(options_.stop, [this] { context_.TryCancel(); });
    const std::chrono::milliseconds timeout = options_.timeout;
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
      std::jthread sender([&](const std::stop_token& stopped) { Send(source, stopped); });
      receive_error = Receive(sink);
      if (!receive_error.ok()) {
        context_.TryCancel();
      }
    }
    const absl::Status status = FromGrpc(stream_->Finish(), context_);
    if (!receive_error.ok()) {
      return {receive_error, false, next_};
    }
    if (timed_out_) {
      return {absl::DeadlineExceededError(
                  fmt::format("no sign of life for {} s, while frame {} was awaited",
                              static_cast<double>(timeout.count()) / 1000, next_)),
              true, next_};
    }
    if (!status.ok()) {
      return {InSequence(status), true, next_};
    }
    if (!send_error_.ok()) {
      return {send_error_, false, next_};
    }
    if (next_ < stretch_.count) {
      return {absl::DataLossError(
                  fmt::format("the stream ended after {} of {} frames", next_, stretch_.count)),
              true, next_};
    }
    return {absl::OkStatus(), true, next_};
  }

 private:
  // With the frame's number in the sequence for that in the stream.
  [[nodiscard]] absl::Status InSequence(const absl::Status& status) const {
    const auto split = SplitFrameError(MessageOf(status));
    return split ? WithRetryHint(
                       absl::Status(status.code(),
                                    fmt::format("frame {}: {}", stretch_.first + split->first,
                                                split->second)),
                       RetryHint(status))
                 : status;
  }

  void Send(const RequestSource& source, const std::stop_token& stopped) {
    bool open = true;
    for (uint64_t index = stretch_.first; open && index < stretch_.count; ++index) {
      if (!progress_.WaitForTurn(index, stretch_.read_ahead, stopped)) {
        return;
      }
      absl::StatusOr<v1::RenderFrameRequest> request = Ask(source, index, stopped);
      if (stopped.stop_requested()) {
        return;  // the receiver knows why
      }
      if (!request.ok()) {
        send_error_ = request.status();  // the frames before this one still come
        break;
      }
      v1::RenderFrameRequest whole = requests_.Add(index, *request);
      v1::RenderSequenceRequest message;
      *message.mutable_frame() = std::move(index == stretch_.first ? whole : *request);
      sent_ = index + 1;  // the answer may come before Write returns
      open = stream_->Write(message);
      progress_.SignOfLife();
    }
    stream_->WritesDone();
  }

  absl::StatusOr<v1::RenderFrameRequest> Ask(const RequestSource& source, uint64_t index,
                                             const std::stop_token& stopped) {
    const OwnWork work(progress_);
    try {
      return source(index, stopped);
    } catch (const std::exception& error) {  // nobody else catches it on this thread
      return absl::InternalError(fmt::format("frame {}: {}", index, error.what()));
    }
  }

  absl::Status Take(const FrameSink& sink, RenderedFrame frame) {
    const OwnWork work(progress_);
    return sink(next_, std::move(frame));
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
      if (message.frame_index() != next_ - stretch_.first) {
        return absl::DataLossError(fmt::format("frame {} came where frame {} was to come",
                                               stretch_.first + message.frame_index(), next_));
      }
      if (next_ >= sent_) {
        return absl::DataLossError(fmt::format(
            "frame {} came, which was not asked for; allowed: only frames before it", next_));
      }
      absl::Status status;
      switch (message.part_case()) {
        case v1::RenderSequenceResponse::kHeader:
          status = assembler.AddHeader(message.header(), requests_.OutputsOf(next_),
                                       options_.max_frame_bytes);
          break;
        case v1::RenderSequenceResponse::kChunk:
          status = assembler.AddChunk(message.chunk(), incoming.chunk_data);
          break;
        case v1::RenderSequenceResponse::kTrailer:
          status = assembler.AddTrailer(message.trailer());
          if (status.ok()) {
            status = Take(sink, assembler.Take());
          }
          if (status.ok()) {
            requests_.Taken(next_++);
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

  const ClientOptions& options_;
  const SequenceStretch& stretch_;
  SequenceRequests& requests_;
  uint64_t next_;
  std::atomic<uint64_t> sent_;  // one past the last frame that was asked for
  Progress progress_;
  grpc::ClientContext context_;
  std::unique_ptr<SequenceStream> stream_;
  std::atomic<bool> timed_out_ = false;
  absl::Status send_error_;
};

}  // namespace

SequenceOutcome RunSequenceStream(grpc::ChannelInterface& channel, const ClientOptions& options,
                                  const SequenceStretch& stretch, SequenceRequests& requests,
                                  const RequestSource& source, const FrameSink& sink) {
  return SequenceCall(channel, options, stretch, requests).Run(source, sink);
}

}  // namespace halflight::client
