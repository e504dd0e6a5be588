#include "server/faulted_requests.h"

namespace halflight {

void FaultedRequests::Blame(const std::string& fingerprint) {
  const std::lock_guard lock(mutex_);
  const auto [entry, added] = entries_.try_emplace(fingerprint);
  ++entry->second.count;
  if (added) {
    latest_first_.push_front(fingerprint);
    entry->second.place = latest_first_.begin();
  } else {
    latest_first_.splice(latest_first_.begin(), latest_first_, entry->second.place);
  }
  if (entries_.size() > kMost) {
    entries_.erase(latest_first_.back());
    latest_first_.pop_back();
  }
}

int FaultedRequests::Count(const std::string& fingerprint) const {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(fingerprint);
  return entry == entries_.end() ? 0 : entry->second.count;
}

}  // namespace halflight
