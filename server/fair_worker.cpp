#include "server/fair_worker.h"

#include <utility>

namespace halflight {

void FairWorker::Post(FairTask task) {
  turns_.Wait({.client = std::move(task.client),
               .priority = task.priority,
               .stop = std::move(task.stop),
               .taken =
                   [this, run = std::move(task.run)](const FairTurns::Turn& turn) {
                     thread_.Post([this, run, turn] {
                       run();
                       turns_.End(turn, [] {});
                     });
                   },
               .cancelled = std::move(task.cancelled)});
}

}  // namespace halflight
