// Uploads that broke off, kept so that they can go on: by name and tenant, since what another sent
// under a name may be anything until it is complete; bounded in number, bytes and age. Knows
// nothing of streams; who uploads takes one out, and owns it alone until it is put back.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "halflight/v1/particles.pb.h"
#include "server/byte_budget.h"
#include "server/caller.h"
#include "server/particle_assembler.h"

namespace halflight {

// What has arrived of one set, with the memory that it holds.
struct PartialUpload {
  // The header has been checked.
  PartialUpload(const v1::ParticleSetDescription& checked, ByteBudget& budget,
                const Caller& uploader = {})
      : header(checked),
        tenant(uploader.tenant),
        assembler(header.layout(), header.byte_size()),
        memory(budget, uploader.client()) {
    header.DiscardUnknownFields();  // it is kept as long as the upload
  }

  v1::ParticleSetDescription header;
  std::string tenant;  // "" where nothing says who it is
  ParticleAssembler assembler;
  std::optional<NamedParticles> finished{};  // once all has arrived and finish was asked for
  ByteBudget::Share memory;
};

struct PartialUploadOptions {
  using Time = std::chrono::steady_clock::time_point;

  uint32_t max_count = 64;
  std::chrono::seconds max_age{600};  // since it broke off; 0 keeps none
  std::function<Time()> now = std::chrono::steady_clock::now;
};

// Thread-safe.
class PartialUploads {
 public:
  // All uploads, under way and kept, take their bytes from `memory`, which must outlive this.
  PartialUploads(ByteBudget& memory, PartialUploadOptions options)
      : memory_(memory), options_(std::move(options)) {}

  [[nodiscard]] ByteBudget& memory() const { return memory_; }

  // Bytes of payload that are kept of the tenant's set.
  [[nodiscard]] uint64_t CommittedBytes(const std::string& sha256, const std::string& tenant = "");

  // Hands out what is kept of the tenant's set that the header describes. OutOfRange, and all stays
  // as it is, where that is less than header.resume_offset.
  absl::StatusOr<std::unique_ptr<PartialUpload>> Take(const v1::ParticleSetDescription& header,
                                                      const std::string& tenant = "");

  // Keeps what an upload leaves. Of two of one name and tenant the one that got further stays.
  // Beyond the count the first that broke off goes, of the client that has most.
  void Keep(std::unique_ptr<PartialUpload> upload);

  // The set is complete: nobody's need be kept.
  void Drop(const std::string& sha256);

  // Grows a share of memory(), for which uploads that are kept make room, those that broke off
  // first first; where only its client has too much, that client's.
  [[nodiscard]] ByteBudget::Growth Grow(ByteBudget::Share& share, uint64_t bytes);

  // Lets go of what is too old. Whatever is asked here looks at ages too: this is for when nobody
  // asks.
  void DropExpired();

  // Uploads that are kept.
  [[nodiscard]] size_t count() const;

 private:
  struct Entry {
    std::unique_ptr<PartialUpload> upload;
    PartialUploadOptions::Time since;
  };
  using Entries = std::list<Entry>;

  // Under the mutex. Uploads hold up to gigabytes, which nobody should wait for to be freed: what
  // is let go is moved to `dropped`, to be freed after the mutex is.
  void Expire(Entries& dropped);
  Entries::iterator FirstOfWhoHasMost();
  Entries::iterator Find(const std::string& sha256, const std::string& tenant);

  ByteBudget& memory_;
  const PartialUploadOptions options_;
  mutable std::mutex mutex_;
  Entries kept_;  // the last that broke off first
};

}  // namespace halflight
