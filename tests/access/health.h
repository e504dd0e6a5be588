// The standard question for health, and the standard answer, without generated stubs.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <grpcpp/channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

namespace halflight::testing {

// An answer: OK and its bytes, or an error.
struct Answer {
  grpc::Status status;
  std::string bytes;
};

// The bytes of a message; none where it has none that can be read.
inline std::string BytesOf(const grpc::ByteBuffer& message) {
  grpc::Slice whole;
  return message.DumpToSingleSlice(&whole).ok()
             ? std::string(reinterpret_cast<const char*>(whole.begin()), whole.size())
             : "";
}

// Calls a method with the bytes of one message.
inline Answer CallRaw(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                      const std::string& request,
                      std::chrono::milliseconds deadline = std::chrono::seconds(30)) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + deadline);
  const grpc::Slice slice(request);
  const auto call = stub.PrepareUnaryCall(&context, method, grpc::ByteBuffer(&slice, 1), &queue);
  Answer answer;
  grpc::ByteBuffer bytes;
  call->StartCall();
  call->Finish(&bytes, &answer.status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  if (answer.status.ok()) {
    answer.bytes = BytesOf(bytes);
  }
  return answer;
}

// HealthCheckResponse { status = 1 }.
inline constexpr const char* kServing = "\x08\x01";
inline constexpr const char* kNotServing = "\x08\x02";

// Of the whole server; empty where there is no answer.
inline std::string Health(const std::shared_ptr<grpc::Channel>& channel,
                          std::chrono::milliseconds deadline = std::chrono::seconds(30)) {
  return CallRaw(channel, "/grpc.health.v1.Health/Check", "", deadline).bytes;
}

// Listens for health of the whole server, as load balancers do.
class HealthWatch {
 public:
  explicit HealthWatch(const std::shared_ptr<grpc::Channel>& channel) : stub_(channel) {
    context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    call_ = stub_.PrepareCall(&context_, "/grpc.health.v1.Health/Watch", &queue_);
    call_->StartCall(nullptr);
    Wait();
    const grpc::Slice nothing;
    call_->WriteLast(grpc::ByteBuffer(&nothing, 1), {}, nullptr);
    Wait();
  }
  ~HealthWatch() {
    context_.TryCancel();
    grpc::Status status;
    call_->Finish(&status, nullptr);
    Wait();
  }
  HealthWatch(const HealthWatch&) = delete;
  HealthWatch& operator=(const HealthWatch&) = delete;
  HealthWatch(HealthWatch&&) = delete;
  HealthWatch& operator=(HealthWatch&&) = delete;

  // The next that it is told; empty where the stream ends.
  std::string Next() {
    grpc::ByteBuffer bytes;
    call_->Read(&bytes, nullptr);
    return Wait() ? BytesOf(bytes) : "";
  }

 private:
  bool Wait() {
    void* tag = nullptr;
    bool ok = false;
    queue_.Next(&tag, &ok);
    return ok;
  }

  grpc::GenericStub stub_;
  grpc::CompletionQueue queue_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

// A channel that shares no connection with others.
inline std::shared_ptr<grpc::Channel> NewChannel(
    const std::string& address, const std::shared_ptr<grpc::ChannelCredentials>& credentials =
                                    grpc::InsecureChannelCredentials()) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 100);
  return grpc::CreateCustomChannel(address, credentials, arguments);
}

}  // namespace halflight::testing
