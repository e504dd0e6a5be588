// What frames leave to those that follow: work on a particle set, kept by what it depends on.
// Knows nothing of what is kept; whoever makes a value says in its key what it depends on.
#pragma once

#include <any>
#include <cstddef>
#include <list>
#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "renderer/scene.h"

namespace halflight {

// Bounded in bytes; what was used longest ago goes first. Holds no particle set: what was kept of
// one is forgotten when its owners have dropped it, and never found again by another set at its
// address. One thread; values that hold GL objects need its context current, here and in the
// destructor.
//
// A key is a struct with a defaulted operator==, and names the type that it stands for:
//   using Value = ...;  // with size_t bytes() const: of all that it holds elsewhere
// Equal keys of the same set have the same value, to the bit.
class FrameCache {
 public:
  // 0 keeps nothing.
  explicit FrameCache(size_t max_bytes) : max_bytes_(max_bytes) {}

  // The value of `key`, kept or from `make()`, which returns an absl::StatusOr of it. Errors are
  // those of `make`. Not kept: a value larger than the bound, or a set that is not owned.
  template <typename Key, typename Make>
  absl::StatusOr<std::shared_ptr<const typename Key::Value>> FindOrMake(
      const std::shared_ptr<const ParticleSet>& set, const Key& key, const Make& make) {
    using Value = typename Key::Value;
    for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
      const auto* const kept = std::any_cast<Key>(&entry->key);
      if (kept == nullptr || !(*kept == key) || entry->set.lock() != set) continue;
      entries_.splice(entries_.begin(), entries_, entry);
      ++found_;
      return std::static_pointer_cast<const Value>(entry->value);
    }
    absl::StatusOr<Value> made = make();
    if (!made.ok()) return made.status();
    auto value = std::make_shared<const Value>(*std::move(made));
    Keep({set, key, value, sizeof(Entry) + sizeof(Key) + sizeof(Value) + value->bytes()});
    return value;
  }

  // What was kept of sets that are gone.
  void ForgetGoneSets();
  void Clear();

  [[nodiscard]] size_t bytes() const { return bytes_; }
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  // How often something kept was found.
  [[nodiscard]] size_t found() const { return found_; }

 private:
  struct Entry {
    std::weak_ptr<const ParticleSet> set;
    std::any key;
    std::shared_ptr<const void> value;
    size_t bytes = 0;
  };

  void Keep(Entry entry);
  std::list<Entry>::iterator Forget(std::list<Entry>::iterator entry);

  size_t max_bytes_;
  size_t bytes_ = 0;
  size_t found_ = 0;
  std::list<Entry> entries_;  // used last first
};

}  // namespace halflight
