// Frames that wait for the renderer, in an order that is fair between clients. Knows neither
// encoding nor sending, and has no bound of its own: whoever pushes limits what is under way.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "renderer/frame_engine.h"
#include "server/faulted_requests.h"

namespace halflight {

// One rendering of a frame that waits. Its timings begin with "queue", the time until the engine
// began it.
struct QueuedFrame {
  std::string client{};
  int priority = 0;      // among the frames of its client: higher goes first
  bool goes_on = false;  // of a frame that was rendered before: before all others of its client
  std::string fingerprint{};  // of all that it is made from
  FrameRequest request{};
  std::stop_token stop{};
  std::function<void()> begun{};  // when its turn has come; may be empty
  FrameEngine::Done done{};
};

// The next frame is that of the client which has had the renderer for the shortest time of late
// (start-time fair queueing: Goyal, Vin and Cheng 1996, with the time a frame took as its length):
// of n clients that always wait, each gets an n-th of the renderer, however many frames it sends
// and however long they are. A client that comes back after a pause has no claim to what it did not
// use.
// A frame under which the device was reset twice is refused from then on.
class FrameQueue {
 public:
  using Clock = std::chrono::steady_clock;

  // Gives the engine, which outlives the queue, `at_once` frames at a time, so that its turn is the
  // last moment at which a frame is chosen. `now` is called
  // by several threads.
  FrameQueue(FrameEngine& engine, int at_once, std::function<Clock::time_point()> now = Clock::now);
  // Waits until `done` of all frames was called.
  ~FrameQueue();
  FrameQueue(const FrameQueue&) = delete;
  FrameQueue& operator=(const FrameQueue&) = delete;
  FrameQueue(FrameQueue&&) = delete;
  FrameQueue& operator=(FrameQueue&&) = delete;

  // `begun` and `done` are called at most once and exactly once, without locks, and must only hand
  // over. `done` gets what the engine says; FailedPrecondition for a frame that the device has
  // failed under twice; of a frame that waits, Cancelled at once when `stop` is requested. Any
  // thread.
  void Push(QueuedFrame frame);

  // Frames that wait. Any thread.
  [[nodiscard]] size_t waiting() const;

 private:
  enum class State : uint8_t { kNew, kWaiting, kTaken, kCancelled };

  struct Entry {
    QueuedFrame frame;
    State state = State::kNew;
    Clock::time_point pushed;
    std::optional<std::stop_callback<std::function<void()>>> on_stop;
  };
  using EntryPtr = std::shared_ptr<Entry>;

  struct Client {
    std::list<EntryPtr> waiting;
    int rendering = 0;
    std::chrono::duration<double> used{0.0};  // counted on from where the others were
  };

  void OnStop(const std::weak_ptr<Entry>& stopped);
  // Hands frames over as long as the engine takes them.
  void Advance();
  // Under the mutex: takes the next frame; null where there is none.
  EntryPtr TakeNext();
  void Give(const EntryPtr& entry);
  absl::Status Submit(const EntryPtr& entry, Clock::time_point begin);
  void End(const Entry& entry, absl::StatusOr<FrameResult> result);
  void OnRendered(const std::string& client, Clock::time_point begin);
  void ForgetIdleClients();

  FrameEngine& engine_;
  FaultedRequests faulted_;
  const int at_once_;
  const std::function<Clock::time_point()> now_;

  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::map<std::string, Client> clients_;
  std::chrono::duration<double> served_{0.0};  // `used` of the client whose turn was last
  int rendering_ = 0;
  int unfinished_ = 0;  // pushed, and `done` not yet returned
};

}  // namespace halflight
