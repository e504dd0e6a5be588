#include "server/open_sequences.h"

#include <algorithm>

namespace halflight {

void OpenSequences::Add(const std::shared_ptr<RenderSequenceHandler>& handler) {
  const std::lock_guard lock(mutex_);
  std::erase_if(open_, [](const auto& other) { return other.expired(); });
  open_.push_back(handler);
  if (draining_) {
    handler->OnDrain();
  }
}

void OpenSequences::Drain() {
  std::vector<std::weak_ptr<RenderSequenceHandler>> open;
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
    open.swap(open_);
  }
  for (const auto& handler : open) {
    if (const auto locked = handler.lock()) {
      locked->OnDrain();
    }
  }
}

}  // namespace halflight
