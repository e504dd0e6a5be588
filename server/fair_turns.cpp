#include "server/fair_turns.h"

#include <algorithm>
#include <utility>

namespace halflight {
namespace {

constexpr size_t kMostRemembered = 1024;

}  // namespace

FairTurns::FairTurns(int at_once, std::function<Clock::time_point()> now)
    : at_once_(at_once), now_(std::move(now)) {}

FairTurns::~FairTurns() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return unfinished_ == 0 && !advancing_; });
}

void FairTurns::Wait(Waiter waiter) {
  const auto entry = std::make_shared<Entry>();
  entry->waiter = std::move(waiter);
  entry->asked = now_();
  // Where stop was requested already, this calls at once, before the entry waits.
  entry->on_stop.emplace(entry->waiter.stop, [this, weak = std::weak_ptr(entry)] { OnStop(weak); });
  std::unique_lock lock(mutex_);
  ++unfinished_;
  if (entry->state == State::kCancelled) {
    lock.unlock();
    entry->waiter.cancelled();
    Finish();
    return;
  }
  Enqueue(entry);
  Advance(lock);
}

// Under the mutex.
void FairTurns::Enqueue(const EntryPtr& entry) {
  entry->state = State::kWaiting;
  const Waiter& waiter = entry->waiter;
  Client& client = clients_[waiter.client];
  if (client.waiting.empty() && client.served == 0) {
    client.used = std::max(client.used, reached_);
  }
  const auto place =
      std::find_if(client.waiting.begin(), client.waiting.end(), [&](const EntryPtr& other) {
        return !other->waiter.goes_on &&
               (waiter.goes_on || waiter.priority > other->waiter.priority);
      });
  client.waiting.insert(place, entry);
}

size_t FairTurns::waiting() const {
  const std::lock_guard lock(mutex_);
  size_t waiting = 0;
  for (const auto& [name, client] : clients_) {
    waiting += client.waiting.size();
  }
  return waiting;
}

void FairTurns::OnStop(const std::weak_ptr<Entry>& stopped) {
  const EntryPtr entry = stopped.lock();
  if (entry == nullptr) {
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    const State before = std::exchange(entry->state, State::kCancelled);
    if (before == State::kTaken) {
      entry->state = State::kTaken;  // the affair of whoever serves it
    }
    if (before != State::kWaiting) {
      return;
    }
    clients_[entry->waiter.client].waiting.remove(entry);
    ForgetIdleClients();
  }
  entry->waiter.cancelled();
  Finish();
}

// Under the lock, which is let go for calls. Gives turns as long as there is room. One thread at a
// time: what it calls may end turns and ask for more, which the loop then finds, so that the stack
// does not grow with them.
void FairTurns::Advance(std::unique_lock<std::mutex>& lock) {
  if (advancing_) {
    return;
  }
  advancing_ = true;
  while (const EntryPtr next = TakeNext()) {
    lock.unlock();
    Give(next);
    lock.lock();
  }
  advancing_ = false;
  idle_.notify_all();
}

// Under the mutex; null where there is none.
FairTurns::EntryPtr FairTurns::TakeNext() {
  if (under_way_ == at_once_) {
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
  reached_ = std::max(reached_, client.used);
  ++client.served;
  ++under_way_;
  return entry;
}

void FairTurns::Give(const EntryPtr& entry) {
  entry->on_stop.reset();  // waits for one that has begun, and finds the entry taken
  entry->waiter.taken({entry->waiter.client, entry->asked, now_()});
}

void FairTurns::End(const Turn& turn, const std::function<void()>& then) {
  std::unique_lock lock(mutex_);
  Client& client = clients_[turn.client];
  client.used += now_() - turn.begin;
  --client.served;
  --under_way_;
  ForgetIdleClients();
  Advance(lock);
  lock.unlock();
  then();
  Finish();
}

void FairTurns::Finish() {
  const std::lock_guard lock(mutex_);
  --unfinished_;
  idle_.notify_all();
}

// Under the mutex. One that would begin where the others are has nothing to be remembered for; and
// nobody shall fill the memory by calling itself something else each time.
void FairTurns::ForgetIdleClients() {
  const bool too_many = clients_.size() > kMostRemembered;
  std::erase_if(clients_, [&](const auto& named) {
    const Client& client = named.second;
    return client.waiting.empty() && client.served == 0 && (too_many || client.used <= reached_);
  });
}

}  // namespace halflight
