#include "server/frame_queue.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "renderer/device_fault.h"
#include "server/error_detail.h"

namespace halflight {
namespace {

absl::Status FaultedError(int times) {
  return WithReason(
      absl::FailedPreconditionError(fmt::format(
          "the device has failed under this request {} times: this server does not draw it again",
          times)),
      v1::ERROR_REASON_FAULTED_TWICE);
}

constexpr size_t kMostRemembered = 1024;

// To what the engine has counted from when it was given the frame.
void AddWait(std::chrono::duration<double, std::milli> wait, std::vector<StageTiming>& timings) {
  if (timings.empty() || timings.front().stage != "queue") {
    timings.insert(timings.begin(), StageTiming{"queue"});
  }
  timings.front().milliseconds += wait.count();
}

}  // namespace

FrameQueue::FrameQueue(FrameEngine& engine, int at_once, std::function<Clock::time_point()> now)
    : engine_(engine), at_once_(at_once), now_(std::move(now)) {}

FrameQueue::~FrameQueue() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return unfinished_ == 0; });
}

void FrameQueue::Push(QueuedFrame frame) {
  const auto entry = std::make_shared<Entry>();
  entry->frame = std::move(frame);
  entry->pushed = now_();
  // Where stop was requested already, this calls at once, before the entry waits.
  entry->on_stop.emplace(entry->frame.stop, [this, weak = std::weak_ptr(entry)] { OnStop(weak); });
  std::unique_lock lock(mutex_);
  ++unfinished_;
  if (entry->state == State::kCancelled) {
    lock.unlock();
    End(*entry, absl::CancelledError("frame cancelled"));
    return;
  }
  entry->state = State::kWaiting;
  Client& client = clients_[entry->frame.client];
  if (client.waiting.empty() && client.rendering == 0) {
    client.used = std::max(client.used, served_);
  }
  const auto place =
      std::find_if(client.waiting.begin(), client.waiting.end(), [&](const EntryPtr& other) {
        return !other->frame.goes_on &&
               (entry->frame.goes_on || entry->frame.priority > other->frame.priority);
      });
  client.waiting.insert(place, entry);
  lock.unlock();
  Advance();
}

size_t FrameQueue::waiting() const {
  const std::lock_guard lock(mutex_);
  size_t waiting = 0;
  for (const auto& [name, client] : clients_) {
    waiting += client.waiting.size();
  }
  return waiting;
}

void FrameQueue::OnStop(const std::weak_ptr<Entry>& stopped) {
  const EntryPtr entry = stopped.lock();
  if (entry == nullptr) {
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    const State before = std::exchange(entry->state, State::kCancelled);
    if (before == State::kTaken) {
      entry->state = State::kTaken;  // the engine's affair
    }
    if (before != State::kWaiting) {
      return;
    }
    clients_[entry->frame.client].waiting.remove(entry);
    ForgetIdleClients();
  }
  End(*entry, absl::CancelledError("frame cancelled"));
}

void FrameQueue::Advance() {
  while (true) {
    EntryPtr next;
    {
      const std::lock_guard lock(mutex_);
      next = TakeNext();
    }
    if (next == nullptr) {
      return;
    }
    Give(next);
  }
}

FrameQueue::EntryPtr FrameQueue::TakeNext() {
  if (rendering_ == at_once_) {
    return nullptr;
  }
  auto least = clients_.end();
  for (auto client = clients_.begin(); client != clients_.end(); ++client) {
    if (!client->second.waiting.empty() &&
        (least == clients_.end() || client->second.used < least->second.used)) {
      least = client;
    }
  }
  if (least == clients_.end()) {
    return nullptr;
  }
  Client& client = least->second;
  EntryPtr entry = std::move(client.waiting.front());
  client.waiting.pop_front();
  entry->state = State::kTaken;
  served_ = std::max(served_, client.used);
  ++client.rendering;
  ++rendering_;
  return entry;
}

void FrameQueue::Give(const EntryPtr& entry) {
  entry->on_stop.reset();  // waits for one that has begun, and finds the entry taken
  QueuedFrame& frame = entry->frame;
  if (frame.begun) {
    frame.begun();
  }
  const auto begin = now_();
  if (const absl::Status status = Submit(entry, begin); !status.ok()) {
    OnRendered(frame.client, begin);
    End(*entry, status);
  }
}

absl::Status FrameQueue::Submit(const EntryPtr& entry, Clock::time_point begin) {
  QueuedFrame& frame = entry->frame;
  const int faults = faulted_.Count(frame.fingerprint);
  if (faults >= FaultedRequests::kTooMany) {
    return FaultedError(faults);
  }
  frame.request.alone = faults > 0;  // so that no other is taken for the cause
  return engine_.Submit(std::move(frame.request), frame.stop,
                        [this, entry, begin](absl::StatusOr<FrameResult> result) {
                          if (IsSuspect(result.status())) {
                            faulted_.Blame(entry->frame.fingerprint);
                          }
                          // The next one first: the engine shall not wait for what becomes of this
                          // one.
                          OnRendered(entry->frame.client, begin);
                          Advance();
                          if (result.ok()) {
                            AddWait(begin - entry->pushed, result->timings);
                          }
                          End(*entry, std::move(result));
                        });
}

void FrameQueue::End(const Entry& entry, absl::StatusOr<FrameResult> result) {
  entry.frame.done(std::move(result));
  const std::lock_guard lock(mutex_);
  --unfinished_;
  idle_.notify_all();
}

void FrameQueue::OnRendered(const std::string& client, Clock::time_point begin) {
  const std::lock_guard lock(mutex_);
  Client& of = clients_[client];
  of.used += now_() - begin;
  --of.rendering;
  --rendering_;
  ForgetIdleClients();
}

// Under the mutex. One that would begin where the others are has nothing to be remembered for; and
// nobody shall fill the memory by calling itself something else each time.
void FrameQueue::ForgetIdleClients() {
  const bool too_many = clients_.size() > kMostRemembered;
  std::erase_if(clients_, [&](const auto& named) {
    const Client& client = named.second;
    return client.waiting.empty() && client.rendering == 0 && (too_many || client.used <= served_);
  });
}

}  // namespace halflight
