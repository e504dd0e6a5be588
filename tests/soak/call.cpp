#include "tests/soak/call.h"

#include <future>
#include <limits>
#include <utility>

#include "client/frame_reader.h"
#include "halflight/v1/service.grpc.pb.h"

namespace halflight::soak {

grpc::ByteBuffer Bytes(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

namespace {

// gRPC 1.51 ends the queue that all callbacks come from with the last channel that has one, and
// fails an assertion at times when the next channel comes right then. So one stays.
void KeepQueueOfCallbacks() {
  static const std::shared_ptr<grpc::Channel> kKept = [] {
    auto channel = grpc::CreateChannel("unix:/nowhere/at/all", grpc::InsecureChannelCredentials());
    grpc::ClientContext context;
    const grpc::ByteBuffer nothing = Bytes("");
    grpc::ByteBuffer answer;
    std::promise<void> done;
    grpc::GenericStub(channel).UnaryCall(&context, "/none", {}, &nothing, &answer,
                                         [&done](const grpc::Status&) { done.set_value(); });
    done.get_future().wait();
    return channel;
  }();
}

// By a message of RenderFrame.
google::protobuf::RepeatedPtrField<v1::Output> OutputsAskedFor(grpc::ByteBuffer message) {
  v1::RenderFrameRequest request;
  grpc::SerializationTraits<v1::RenderFrameRequest>::Deserialize(&message, &request);
  return request.outputs();
}

}  // namespace

std::shared_ptr<Call> Call::Start(const std::shared_ptr<grpc::Channel>& channel,
                                  CallOptions options) {
  KeepQueueOfCallbacks();
  const std::shared_ptr<Call> call(new Call(std::move(options)));  // the constructor is private
  call->self_ = call;
  if (!call->options_.token.empty()) {
    call->context_.AddMetadata("authorization", "Bearer " + call->options_.token);
  }
  if (call->options_.deadline.has_value()) {
    call->context_.set_deadline(std::chrono::system_clock::now() + *call->options_.deadline);
  }
  call->begin_ = Clock::now();
  grpc::GenericStub(channel).PrepareBidiStreamingCall(
      &call->context_, "/halflight.v1.RenderService/" + call->options_.method, {}, call.get());
  if (call->options_.read_at_most != std::numeric_limits<int>::max()) {
    call->held_ = true;
    call->AddHold();
  }
  call->WriteNext();
  call->StartRead(&call->incoming_);
  call->StartCall();
  return call;
}

void Call::WriteNext() {
  if (next_ == options_.messages.size()) {
    StartWritesDone();
    return;
  }
  const grpc::ByteBuffer& message = options_.messages[next_++];
  if (next_ == options_.messages.size()) {
    StartWriteLast(&message, {});
  } else {
    StartWrite(&message);
  }
}

void Call::OnWriteDone(bool ok) {
  if (ok && next_ < options_.messages.size()) {
    WriteNext();
  }
}

void Call::Cancel() {
  context_.TryCancel();
  LetGo();
}

void Call::ReadOn() {
  read_at_most_ = std::numeric_limits<int>::max();
  if (held_) {
    StartRead(&incoming_);
    LetGo();
  }
}

void Call::LetGo() {
  if (held_.exchange(false)) {
    RemoveHold();
  }
}

void Call::OnReadDone(bool ok) {
  if (!ok) {
    LetGo();
    return;
  }
  if (options_.keep_frame) {
    AddToFrame();
  }
  last_ = incoming_;
  int count = 0;
  {
    const std::lock_guard lock(mutex_);
    count = ++messages_;
  }
  changed_.notify_all();
  if (count < read_at_most_) {
    StartRead(&incoming_);
  }
}

void Call::AddToFrame() {
  client::IncomingMessage<v1::RenderFrameResponse> part;
  sound_ = sound_ && client::Read(incoming_, part).ok();
  if (!sound_) {
    return;
  }
  switch (part.message.part_case()) {
    case v1::RenderFrameResponse::kHeader:
      sound_ = assembler_
                   .AddHeader(part.message.header(), OutputsAskedFor(options_.messages.front()),
                              std::numeric_limits<uint64_t>::max())
                   .ok();
      break;
    case v1::RenderFrameResponse::kChunk:
      sound_ = assembler_.AddChunk(part.message.chunk(), part.chunk_data).ok();
      break;
    case v1::RenderFrameResponse::kTrailer:
      sound_ = assembler_.AddTrailer(part.message.trailer()).ok();
      if (sound_) {
        frame_ = assembler_.Take();
      }
      break;
    case v1::RenderFrameResponse::PART_NOT_SET:
      sound_ = false;
  }
}

void Call::OnDone(const grpc::Status& status) {
  const std::shared_ptr<Call> self = std::move(self_);  // this may be the last who holds it
  const std::lock_guard lock(mutex_);
  end_ = Clock::now();
  status_ = status;
  done_ = true;
  changed_.notify_all();
}

const grpc::Status& Call::Wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return done_; });
  return status_;
}

bool Call::done() const {
  const std::lock_guard lock(mutex_);
  return done_;
}

bool Call::WaitForMessages(int count) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return done_ || messages_ >= count; });
  return messages_ >= count;
}

int Call::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

double Call::milliseconds() const {
  return std::chrono::duration<double, std::milli>(end_ - begin_).count();
}

}  // namespace halflight::soak
