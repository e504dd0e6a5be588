// The particle sets that the server holds, by name, bounded in bytes and number: the least recently
// used go first. In memory, and where there is a cache directory also there. Knows nothing of how
// sets arrive or what is in them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <unordered_map>

#include "renderer/scene.h"

namespace halflight {

class ParticleFiles;

// Bytes of memory that the values of a set take.
uint64_t MemoryBytes(const ParticleSet& set);

// Thread-safe. A set in use outlives its place here: dropping it only drops the store's reference.
class ParticleStore {
 public:
  // Whatever their size: what a set takes beside its values is not counted.
  static constexpr size_t kMaxSets = 65536;

  // In memory alone.
  explicit ParticleStore(uint64_t max_bytes);
  // `files`: the cache directory; null where there is none.
  ParticleStore(uint64_t max_bytes, std::unique_ptr<ParticleFiles> files);
  // Finishes what waits to be read from disk and written to it.
  ~ParticleStore();
  ParticleStore(const ParticleStore&) = delete;
  ParticleStore& operator=(const ParticleStore&) = delete;
  ParticleStore(ParticleStore&&) = delete;
  ParticleStore& operator=(ParticleStore&&) = delete;

  // The set, which counts as used now; null where it is not in memory.
  std::shared_ptr<const ParticleSet> Find(const std::string& sha256);

  // Whether the set is held, in memory or on disk. It counts as used: what a client asks about it
  // is about to use.
  bool Touch(const std::string& sha256);

  // Whether Find would find the set only after Fetch.
  [[nodiscard]] bool OnDiskOnly(const std::string& sha256);

  // Reads the set from disk into memory, on another thread, which then calls `then`: also where the
  // file turned out to be damaged or gone, and where `stop` was requested before it was read. Only
  // where there is a cache directory.
  void Fetch(const std::string& sha256, std::stop_token stop, std::function<void()> then);

  // Keeps the set and drops others for it. A set of the same name that is held already stays. A set
  // larger than the whole store is not kept. On disk it is a little later.
  void Insert(const std::string& sha256, std::shared_ptr<const ParticleSet> set);

  struct State {
    uint64_t bytes = 0;  // in memory
    uint64_t sets = 0;
    uint64_t hits = 0;  // what Find has come to so far
    uint64_t misses = 0;
    uint64_t disk_bytes = 0;  // in the cache directory
    uint64_t disk_sets = 0;
    uint64_t disk_reads = 0;  // what Fetch has come to so far
    uint64_t failed_disk_reads = 0;
  };
  [[nodiscard]] State state() const;
  // In memory.
  [[nodiscard]] uint64_t bytes() const;
  // Whether nothing waits to be written to disk.
  [[nodiscard]] bool idle() const;

 private:
  struct Entry {
    std::string sha256;
    std::shared_ptr<const ParticleSet> set;
    uint64_t bytes;
  };

  bool InMemory(const std::string& sha256) const;
  // Find without counting.
  std::shared_ptr<const ParticleSet> Use(const std::string& sha256);
  void Keep(const std::string& sha256, std::shared_ptr<const ParticleSet> set);

  const uint64_t max_bytes_;
  mutable std::mutex mutex_;
  uint64_t bytes_ = 0;
  std::atomic<uint64_t> hits_ = 0;
  std::atomic<uint64_t> misses_ = 0;
  std::atomic<uint64_t> disk_reads_ = 0;
  std::atomic<uint64_t> failed_disk_reads_ = 0;
  std::list<Entry> by_use_;  // most recently used first
  std::unordered_map<std::string, std::list<Entry>::iterator> by_name_;
  std::unique_ptr<ParticleFiles> files_;  // last: its threads use all of the above
};

}  // namespace halflight
