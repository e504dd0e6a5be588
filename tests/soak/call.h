// One call in bytes, as it goes over the wire: what clients send, and read, may be anything.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <grpcpp/channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include "client/frame_assembler.h"

namespace halflight::soak {

using Clock = std::chrono::steady_clock;

inline constexpr const char* kRenderFrame = "RenderFrame";

struct CallOptions {
  std::string method = kRenderFrame;  // of the service
  std::vector<grpc::ByteBuffer> messages{};
  // So many are read, then nothing until ReadOn: a client that does not take what is sent to it. As
  // long as something lies unread, gRPC does not tell how the call has ended.
  int read_at_most = std::numeric_limits<int>::max();
  bool keep_frame = false;  // of RenderFrame: put it together, check it, and keep it
  std::string token{};
  std::optional<std::chrono::milliseconds> deadline{};
};

// Shared, since gRPC holds it until the call has ended, whoever else does.
class Call final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  // Begins the call: sends all messages, then the end of them.
  static std::shared_ptr<Call> Start(const std::shared_ptr<grpc::Channel>& channel,
                                     CallOptions options);

  void Cancel();
  // Reads what is left, and all that comes.
  void ReadOn();
  // Waits for the end.
  const grpc::Status& Wait();
  [[nodiscard]] bool done() const;
  // Waits until so many messages have come, or the call has ended; whether they have.
  bool WaitForMessages(int count);
  [[nodiscard]] int messages() const;

  // After the end.
  [[nodiscard]] const grpc::Status& status() const { return status_; }
  [[nodiscard]] double milliseconds() const;
  [[nodiscard]] Clock::time_point ended() const { return end_; }
  // With keep_frame: whether header, chunks and trailer have come and fit together.
  [[nodiscard]] bool whole() const { return frame_.has_value(); }
  [[nodiscard]] const client::RenderedFrame& frame() const { return *frame_; }
  // What came last.
  [[nodiscard]] const grpc::ByteBuffer& last() const { return last_; }

 private:
  explicit Call(CallOptions options)
      : options_(std::move(options)), read_at_most_(options_.read_at_most) {}

  void OnWriteDone(bool ok) override;
  void OnReadDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

  void WriteNext();
  void AddToFrame();
  // Once it has read all that it may, only the end is waited for.
  void LetGo();

  const CallOptions options_;
  std::shared_ptr<Call> self_;  // until the end
  std::atomic<int> read_at_most_;
  std::atomic<bool> held_ = false;  // so that reads may begin outside of reactions
  grpc::ClientContext context_;
  size_t next_ = 0;
  grpc::ByteBuffer incoming_;
  grpc::ByteBuffer last_;
  client::FrameAssembler assembler_;
  bool sound_ = true;
  std::optional<client::RenderedFrame> frame_;
  Clock::time_point begin_;
  Clock::time_point end_;
  grpc::Status status_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  int messages_ = 0;
  bool done_ = false;
};

grpc::ByteBuffer Bytes(const std::string& bytes);

}  // namespace halflight::soak
