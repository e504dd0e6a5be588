// Threads that work off tasks in turns that are fair between clients. Have no bound of their own:
// whoever posts limits what is under way.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "server/fair_turns.h"
#include "server/worker_pool.h"

namespace halflight {

struct FairTask {
  std::string client{};
  int priority = 0;  // among the tasks of its client: higher goes first
  std::stop_token stop{};
  std::function<void()> run{};
  std::function<void()> cancelled{};  // instead, where `stop` is requested before its turn
};

class FairWorkers {
 public:
  explicit FairWorkers(int threads) : threads_(threads), turns_(threads) {}

  // Any thread, also from within a task; never waits for a task. `cancelled` is called at once, on
  // the thread that requests the stop, and must only hand over. Before the workers are gone, one
  // of the two was called and has returned.
  void Post(FairTask task);

  // Tasks that wait. Any thread.
  [[nodiscard]] size_t waiting() const { return turns_.waiting(); }

 private:
  WorkerPool threads_;
  FairTurns turns_;  // its end waits for the last turn, so the threads outlive it
};

}  // namespace halflight
