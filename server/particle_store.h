// The particle sets that the server holds, by name, bounded in bytes and number: the least recently
// used go first, and none that is in use. In memory, and where there is a cache directory also
// there. Knows nothing of how sets arrive or what is in them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/status.h"
#include "renderer/scene.h"

namespace halflight {

class ParticleFiles;

// Bytes of memory that the values of a set take.
uint64_t MemoryBytes(const ParticleSet& set);

// Thread-safe. A set is in use while somebody holds what Find gave, or it waits to be written to
// disk: what sets take is bounded, whoever holds them.
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

  // The set, which counts as used now; null where it is not in memory. Who looks for one that is on
  // disk fetches it and looks again, so that is neither a hit nor a miss.
  std::shared_ptr<const ParticleSet> Find(const std::string& sha256);

  // The same again for a frame that has found it before: not counted as another lookup.
  std::shared_ptr<const ParticleSet> Use(const std::string& sha256);

  // Whether the set is held, in memory or on disk. It counts as used: what a client asks about it
  // is about to use.
  bool Touch(const std::string& sha256);

  // Reads the set from disk into memory, on another thread, which then calls `then`: with OK also
  // where the file turned out to be damaged or gone, and where `stop` was requested before it was
  // read; Unavailable, with reason and retry hint, where its file cannot be opened just now. Where
  // it finds no room `then` has the error of Insert. At once where nothing needs to be read: it is
  // in memory, there is no cache directory, or that there is no room can be told before.
  void Fetch(const std::string& sha256, std::stop_token stop,
             std::function<void(const absl::Status&)> then);

  // Keeps the set and drops others for it. A set of the same name that is held already stays.
  // ResourceExhausted, with reason and retry hint, where sets in use leave no room for it. On disk
  // it is a little later.
  absl::Status Insert(const std::string& sha256, std::shared_ptr<const ParticleSet> set);

  // What Insert would say of a set of so many bytes.
  [[nodiscard]] absl::Status CheckRoom(uint64_t bytes) const;

  struct State {
    uint64_t bytes = 0;  // in memory
    uint64_t sets = 0;
    uint64_t hits = 0;  // of Find so far
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
  using Entries = std::list<Entry>;

  bool InMemory(const std::string& sha256) const;
  absl::Status Keep(const std::string& sha256, std::shared_ptr<const ParticleSet> set);
  // Under the mutex: whom to drop for a set of so many bytes; none where that does not do.
  [[nodiscard]] std::optional<std::vector<Entries::const_iterator>> ToDropFor(uint64_t bytes) const;

  const uint64_t max_bytes_;
  mutable std::mutex mutex_;
  uint64_t bytes_ = 0;
  std::atomic<uint64_t> hits_ = 0;
  std::atomic<uint64_t> misses_ = 0;
  std::atomic<uint64_t> disk_reads_ = 0;
  std::atomic<uint64_t> failed_disk_reads_ = 0;
  Entries by_use_;  // most recently used first
  std::unordered_map<std::string, Entries::iterator> by_name_;
  std::unique_ptr<ParticleFiles> files_;  // last: its threads use all of the above
};

}  // namespace halflight
