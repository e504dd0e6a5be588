#include "server/particle_store.h"

#include <utility>
#include <vector>

#include <fmt/format.h>

#include "server/error_detail.h"
#include "server/particle_files.h"

namespace halflight {
namespace {

absl::Status FullError(uint64_t bytes, uint64_t max_bytes) {
  return BusyError(
      v1::ERROR_REASON_CACHE_FULL, fmt::format("{} bytes more", bytes),
      fmt::format("{} bytes of particle sets, and those in use leave less", max_bytes));
}

}  // namespace

uint64_t MemoryBytes(const ParticleSet& set) {
  const auto of = [](const auto& values) { return values.size() * sizeof(*values.data()); };
  return of(set.positions) + of(set.radii) + of(set.opacities) + of(set.colors) +
         of(set.velocities) + of(set.emissions);
}

ParticleStore::ParticleStore(uint64_t max_bytes) : ParticleStore(max_bytes, nullptr) {}

ParticleStore::ParticleStore(uint64_t max_bytes, std::unique_ptr<ParticleFiles> files)
    : max_bytes_(max_bytes), files_(std::move(files)) {}

ParticleStore::~ParticleStore() = default;

std::shared_ptr<const ParticleSet> ParticleStore::Find(const std::string& sha256) {
  auto set = Use(sha256);
  if (set != nullptr) {
    ++hits_;
  } else if (files_ == nullptr || !files_->Use(sha256)) {
    ++misses_;
  }
  return set;
}

std::shared_ptr<const ParticleSet> ParticleStore::Use(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  const auto found = by_name_.find(sha256);
  if (found == by_name_.end()) {
    return nullptr;
  }
  by_use_.splice(by_use_.begin(), by_use_, found->second);
  if (files_ != nullptr) {
    files_->Use(sha256);
  }
  return found->second->set;
}

bool ParticleStore::Touch(const std::string& sha256) {
  return Use(sha256) != nullptr || (files_ != nullptr && files_->Use(sha256));
}

bool ParticleStore::InMemory(const std::string& sha256) const {
  const std::lock_guard lock(mutex_);
  return by_name_.find(sha256) != by_name_.end();
}

void ParticleStore::Fetch(const std::string& sha256, std::stop_token stop,
                          std::function<void(const absl::Status&)> then) {
  if (InMemory(sha256) || files_ == nullptr) {
    then(absl::OkStatus());
    return;
  }
  // A file that could never be taken is looked at, which finds that out for good.
  if (const uint64_t bytes = files_->LeastMemoryBytes(sha256); bytes <= max_bytes_) {
    if (absl::Status room = CheckRoom(bytes); !room.ok()) {
      then(room);
      return;
    }
  }
  files_->Read(sha256, std::move(stop), [this, sha256, then = std::move(then)](const auto& set) {
    const bool read = set.ok() && *set != nullptr;
    ++(read ? disk_reads_ : failed_disk_reads_);
    then(read ? Keep(sha256, *set) : set.status());
  });
}

absl::Status ParticleStore::Insert(const std::string& sha256,
                                   std::shared_ptr<const ParticleSet> set) {
  absl::Status kept = Keep(sha256, set);
  if (kept.ok() && files_ != nullptr) {
    files_->Write(sha256, std::move(set));
  }
  return kept;
}

std::optional<std::vector<ParticleStore::Entries::const_iterator>> ParticleStore::ToDropFor(
    uint64_t bytes) const {
  std::vector<Entries::const_iterator> dropped;
  uint64_t left = bytes_;
  const auto fits = [&] {
    return left + bytes <= max_bytes_ && by_use_.size() - dropped.size() < kMaxSets;
  };
  for (auto entry = by_use_.end(); !fits() && entry != by_use_.begin();) {
    --entry;
    // Who has no reference by now gets one from here alone.
    if (entry->set.use_count() == 1) {
      left -= entry->bytes;
      dropped.push_back(entry);
    }
  }
  return fits() ? std::optional(std::move(dropped)) : std::nullopt;
}

absl::Status ParticleStore::CheckRoom(uint64_t bytes) const {
  const std::lock_guard lock(mutex_);
  return ToDropFor(bytes).has_value() ? absl::OkStatus() : FullError(bytes, max_bytes_);
}

absl::Status ParticleStore::Keep(const std::string& sha256,
                                 std::shared_ptr<const ParticleSet> set) {
  const uint64_t bytes = MemoryBytes(*set);
  // Freed after the lock is: giving back a gigabyte takes longer than anybody should wait.
  std::vector<std::shared_ptr<const ParticleSet>> dropped;
  const std::lock_guard lock(mutex_);
  if (const auto found = by_name_.find(sha256); found != by_name_.end()) {
    by_use_.splice(by_use_.begin(), by_use_, found->second);
    return absl::OkStatus();
  }
  const auto to_drop = ToDropFor(bytes);
  if (!to_drop.has_value()) {
    return FullError(bytes, max_bytes_);
  }
  for (const Entries::const_iterator entry : *to_drop) {
    bytes_ -= entry->bytes;
    dropped.push_back(entry->set);
    by_name_.erase(entry->sha256);
    by_use_.erase(entry);
  }
  by_use_.push_front({sha256, std::move(set), bytes});
  by_name_[sha256] = by_use_.begin();
  bytes_ += bytes;
  return absl::OkStatus();
}

ParticleStore::State ParticleStore::state() const {
  State state{.hits = hits_,
              .misses = misses_,
              .disk_reads = disk_reads_,
              .failed_disk_reads = failed_disk_reads_};
  if (files_ != nullptr) {
    state.disk_bytes = files_->bytes();
    state.disk_sets = files_->sets();
  }
  const std::lock_guard lock(mutex_);
  state.bytes = bytes_;
  state.sets = by_use_.size();
  return state;
}

uint64_t ParticleStore::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

bool ParticleStore::idle() const { return files_ == nullptr || files_->idle(); }

}  // namespace halflight
