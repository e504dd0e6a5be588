// Turns at something that serves few at a time, in an order that is fair between clients. Knows not
// what it is, and has no bound of its own: whoever waits here was admitted elsewhere.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

namespace halflight {

// The next turn is that of the client which has been served for the shortest time of late
// (start-time fair queueing: Goyal, Vin and Cheng 1996, with the time a turn took as its length):
// of n clients that always wait, each gets an n-th of the time, however many turns it asks for and
// however long they are. A client that comes back after a pause has no claim to what it did not
// use.
class FairTurns {
 public:
  using Clock = std::chrono::steady_clock;

  struct Turn {
    std::string client{};
    Clock::time_point asked{};
    Clock::time_point begin{};
  };

  // Its functions are called without locks, and must only hand over.
  struct Waiter {
    std::string client{};
    int priority = 0;      // among those of its client: higher goes first
    bool goes_on = false;  // of what had a turn before: before all others of its client
    std::stop_token stop{};
    std::function<void(const Turn&)> taken{};  // its turn has come, until End
    std::function<void()> cancelled{};         // instead, at once when `stop` is requested before
  };

  // `at_once` turns at a time. `now` is called by several threads.
  explicit FairTurns(int at_once, std::function<Clock::time_point()> now = Clock::now);
  // Waits until every turn has ended, and what was called has returned.
  ~FairTurns();
  FairTurns(const FairTurns&) = delete;
  FairTurns& operator=(const FairTurns&) = delete;
  FairTurns(FairTurns&&) = delete;
  FairTurns& operator=(FairTurns&&) = delete;

  // Any thread.
  void Wait(Waiter waiter);

  // Gives the next one its turn, so that what is shared shall not stand still, and only then calls
  // `then`. Once for each turn, also from within `taken`. Any thread.
  void End(const Turn& turn, const std::function<void()>& then);

  // Those that wait. Any thread.
  [[nodiscard]] size_t waiting() const;

 private:
  enum class State : uint8_t { kNew, kWaiting, kTaken, kCancelled };

  struct Entry {
    Waiter waiter;
    State state = State::kNew;
    Clock::time_point asked;
    std::optional<std::stop_callback<std::function<void()>>> on_stop;
  };
  using EntryPtr = std::shared_ptr<Entry>;

  struct Client {
    std::list<EntryPtr> waiting;
    int served = 0;                           // turns under way
    std::chrono::duration<double> used{0.0};  // counted on from where the others were
  };

  void OnStop(const std::weak_ptr<Entry>& stopped);
  void Enqueue(const EntryPtr& entry);
  void Advance(std::unique_lock<std::mutex>& lock);
  EntryPtr TakeNext();
  void Give(const EntryPtr& entry);
  void Finish();
  void ForgetIdleClients();

  const int at_once_;
  const std::function<Clock::time_point()> now_;

  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::map<std::string, Client> clients_;
  std::chrono::duration<double> reached_{0.0};  // `used` of the client whose turn was last
  int under_way_ = 0;
  int unfinished_ = 0;      // asked for, and neither `cancelled` nor End has returned
  bool advancing_ = false;  // by a thread that sees what the others leave to it
};

}  // namespace halflight
