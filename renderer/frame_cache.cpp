#include "renderer/frame_cache.h"

namespace halflight {

void FrameCache::ForgetGoneSets() {
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    entry = entry->set.expired() ? Forget(entry) : std::next(entry);
  }
}

void FrameCache::Clear() {
  entries_.clear();
  bytes_ = 0;
}

void FrameCache::Keep(Entry entry) {
  if (entry.bytes > max_bytes_ || entry.set.expired()) return;
  while (bytes_ + entry.bytes > max_bytes_) Forget(std::prev(entries_.end()));
  bytes_ += entry.bytes;
  entries_.push_front(std::move(entry));
}

std::list<FrameCache::Entry>::iterator FrameCache::Forget(std::list<Entry>::iterator entry) {
  bytes_ -= entry->bytes;
  return entries_.erase(entry);
}

}  // namespace halflight
