#include "server/fair_workers.h"

#include <utility>

namespace halflight {

void FairWorkers::Post(FairTask task) {
  turns_.Wait({.client = std::move(task.client),
               .priority = task.priority,
               .stop = std::move(task.stop),
               .taken =
                   [this, run = std::move(task.run)](const FairTurns::Turn& turn) {
                     threads_.Post([this, run, turn] {
                       run();
                       turns_.End(turn, [] {});
                     });
                   },
               .cancelled = std::move(task.cancelled)});
}

}  // namespace halflight
