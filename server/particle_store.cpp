#include "server/particle_store.h"

#include <utility>
#include <vector>

#include "server/particle_files.h"

namespace halflight {

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
  ++(set != nullptr ? hits_ : misses_);
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

bool ParticleStore::OnDiskOnly(const std::string& sha256) {
  return files_ != nullptr && !InMemory(sha256) && files_->Use(sha256);
}

void ParticleStore::Fetch(const std::string& sha256, std::stop_token stop,
                          std::function<void()> then) {
  files_->Read(sha256, std::move(stop), [this, sha256, then = std::move(then)](const auto& set) {
    ++(set != nullptr ? disk_reads_ : failed_disk_reads_);
    if (set != nullptr) {
      Keep(sha256, set);
    }
    then();
  });
}

void ParticleStore::Insert(const std::string& sha256, std::shared_ptr<const ParticleSet> set) {
  if (files_ != nullptr) {
    files_->Write(sha256, set);
  }
  Keep(sha256, std::move(set));
}

void ParticleStore::Keep(const std::string& sha256, std::shared_ptr<const ParticleSet> set) {
  const uint64_t bytes = MemoryBytes(*set);
  if (bytes > max_bytes_) {
    return;
  }
  // Freed after the lock is: giving back a gigabyte takes longer than anybody should wait.
  std::vector<std::shared_ptr<const ParticleSet>> dropped;
  const std::lock_guard lock(mutex_);
  if (const auto found = by_name_.find(sha256); found != by_name_.end()) {
    by_use_.splice(by_use_.begin(), by_use_, found->second);
    return;
  }
  while (bytes_ + bytes > max_bytes_ || by_use_.size() >= kMaxSets) {
    Entry& oldest = by_use_.back();
    bytes_ -= oldest.bytes;
    by_name_.erase(oldest.sha256);
    dropped.push_back(std::move(oldest.set));
    by_use_.pop_back();
  }
  by_use_.push_front({sha256, std::move(set), bytes});
  by_name_[sha256] = by_use_.begin();
  bytes_ += bytes;
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
