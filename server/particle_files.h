// Particle sets in a directory, so that they outlast the process: one file a set, named by its
// SHA-256, bounded in bytes and number, the least recently used going first. Reads and writes on
// threads of its own; knows nothing of what is in memory.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "renderer/scene.h"
#include "server/file_descriptor.h"
#include "server/limits.h"
#include "server/worker_pool.h"

namespace halflight {

// Thread-safe. One process at a time uses a directory: a lock in it sees to that. A set is written
// to a file of another name first, so that a file of a set's name is whole, barring damage; that is
// looked for when the set is read.
class ParticleFiles {
 public:
  using Done = std::function<void(const absl::StatusOr<std::shared_ptr<const ParticleSet>>& set)>;

  // Sets of which files are kept, whatever their size.
  static constexpr size_t kMaxFiles = 65536;
  // Sets that wait to be written.
  static constexpr size_t kMaxWaiting = 1024;

  // Makes the directory where it is missing, looks at names, sizes and times in it, and removes
  // what an interrupted write left, as well as the oldest sets beyond limits.max_cache_dir_bytes.
  // Anything else in it is left alone. The error says what does not work with which path.
  static absl::StatusOr<std::unique_ptr<ParticleFiles>> Open(const std::string& path,
                                                             const ServerLimits& limits);

  // Finishes what waits to be read and to be written.
  ~ParticleFiles();
  ParticleFiles(const ParticleFiles&) = delete;
  ParticleFiles& operator=(const ParticleFiles&) = delete;
  ParticleFiles(ParticleFiles&&) = delete;
  ParticleFiles& operator=(ParticleFiles&&) = delete;

  // Whether the set is here as far as names tell. If so it counts as used now, here and, by the
  // file's time, after a restart.
  bool Use(const std::string& sha256);

  // Writes the set unless it is here, is being written, or is empty. It stays in memory until it is
  // written, and with it as many sets as limits.max_cache_bytes / 4 has room for, or one; a set
  // that finds no room, or no space on disk, is not written, which the log says.
  void Write(const std::string& sha256, std::shared_ptr<const ParticleSet> set);

  // Reads the set and calls `done`, on the thread that reads, with null where it is not here,
  // `stop` was requested before, or its file is damaged, which then is removed. Unavailable, with
  // reason and retry hint, where it cannot be opened for want of descriptors or memory. Who calls
  // bounds how many wait.
  void Read(const std::string& sha256, std::stop_token stop, Done done);

  // What the set takes in memory, at least: its file is counted in blocks. 0 where it is not here.
  [[nodiscard]] uint64_t LeastMemoryBytes(const std::string& sha256) const;

  // Whether nothing waits to be written.
  [[nodiscard]] bool idle() const;
  // Of all files that are written, each counted in blocks.
  [[nodiscard]] uint64_t bytes() const;
  [[nodiscard]] size_t sets() const;

 private:
  struct File {
    std::string sha256;
    uint64_t bytes;
    bool touched = false;  // its time is about to be set
  };
  struct Reader {
    std::stop_token stop;
    Done done;
  };

  ParticleFiles(FileDescriptor directory, FileDescriptor lock, std::string path,
                const ServerLimits& limits);

  absl::Status Scan();
  void WriteNow(const std::string& sha256, const std::shared_ptr<const ParticleSet>& set);
  absl::Status WriteFile(const std::string& sha256, const ParticleSet& set);
  void ReadNow(const std::string& sha256);
  absl::StatusOr<std::shared_ptr<const ParticleSet>> ReadFile(const std::string& sha256);
  void SetTime(const std::string& sha256);
  // The same until there is room for this much more within the bounds.
  void MakeRoom(uint64_t bytes);
  // Removes the least recently used until no more than this is here.
  void RemoveDownTo(uint64_t bytes);
  bool Forget(const std::string& sha256);

  const FileDescriptor directory_;
  const FileDescriptor lock_;
  const std::string path_;
  const ServerLimits limits_;
  mutable std::mutex mutex_;
  std::list<File> by_use_;  // most recently used first
  std::unordered_map<std::string, std::list<File>::iterator> by_name_;
  uint64_t bytes_ = 0;
  std::set<std::string> waiting_;  // to be written
  uint64_t waiting_bytes_ = 0;
  std::unordered_map<std::string, std::vector<Reader>> readers_;
  // Last, so that they end first. All that changes the directory is done by the one that writes.
  WorkerPool writer_{1};
  WorkerPool reader_{1};
};

}  // namespace halflight
