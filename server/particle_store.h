// The particle sets that the server holds, by name, bounded in bytes: the least recently used go
// first. Knows nothing of how sets arrive or what is in them.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "renderer/scene.h"

namespace halflight {

// Bytes of memory that the values of a set take.
uint64_t MemoryBytes(const ParticleSet& set);

// Thread-safe. A set in use outlives its place here: dropping it only drops the store's reference.
class ParticleStore {
 public:
  explicit ParticleStore(uint64_t max_bytes) : max_bytes_(max_bytes) {}

  // The set, which counts as used now; null where it is not held.
  std::shared_ptr<const ParticleSet> Find(const std::string& sha256);

  // Like Find, without handing the set out: what a client asks about it is about to use.
  bool Touch(const std::string& sha256) { return Find(sha256) != nullptr; }

  // Keeps the set and drops others for it. A set of the same name that is held already stays. A set
  // larger than the whole store is not kept.
  void Insert(const std::string& sha256, std::shared_ptr<const ParticleSet> set);

  [[nodiscard]] uint64_t bytes() const;

 private:
  struct Entry {
    std::string sha256;
    std::shared_ptr<const ParticleSet> set;
    uint64_t bytes;
  };

  const uint64_t max_bytes_;
  mutable std::mutex mutex_;
  uint64_t bytes_ = 0;
  std::list<Entry> by_use_;  // most recently used first
  std::unordered_map<std::string, std::list<Entry>::iterator> by_name_;
};

}  // namespace halflight
