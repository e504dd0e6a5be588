// Sequences under way, which a drain has to end.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "server/handlers/render_sequence.h"

namespace halflight {

// A drain ends each where it stands, since its client may never say that it wants no more. Any
// thread.
class OpenSequences {
 public:
  // Until `handler` is gone.
  void Add(const std::shared_ptr<RenderSequenceHandler>& handler);
  // All of them, and from now on each that is added.
  void Drain();

 private:
  std::mutex mutex_;
  std::vector<std::weak_ptr<RenderSequenceHandler>> open_;
  bool draining_ = false;
};

}  // namespace halflight
