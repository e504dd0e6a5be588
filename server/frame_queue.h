// Frames that wait for the renderer, in an order that is fair between clients. Knows neither
// encoding nor sending, and has no bound of its own: whoever pushes limits what is under way.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "renderer/frame_engine.h"
#include "server/fair_turns.h"
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

// Whose frame is next, FairTurns says.
// A frame under which the device was reset twice is refused from then on.
class FrameQueue {
 public:
  using Clock = FairTurns::Clock;

  // Gives the engine, which outlives the queue, `at_once` frames at a time, so that its turn is the
  // last moment at which a frame is chosen. `now` is called by several threads.
  FrameQueue(FrameEngine& engine, int at_once, std::function<Clock::time_point()> now = Clock::now);
  // Waits until `done` of all frames was called.
  ~FrameQueue() = default;
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
  [[nodiscard]] size_t waiting() const { return turns_.waiting(); }

 private:
  void Give(const std::shared_ptr<QueuedFrame>& frame, const FairTurns::Turn& turn);
  absl::Status Submit(const std::shared_ptr<QueuedFrame>& frame, const FairTurns::Turn& turn);

  FrameEngine& engine_;
  FaultedRequests faulted_;
  FairTurns turns_;  // last: what it calls uses all of the above
};

}  // namespace halflight
