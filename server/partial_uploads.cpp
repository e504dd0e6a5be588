#include "server/partial_uploads.h"

#include <algorithm>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "server/convert/field_checks.h"
#include "server/status_text.h"

namespace halflight {

PartialUploads::Entries::iterator PartialUploads::Find(const std::string& sha256,
                                                       const std::string& tenant) {
  return std::find_if(kept_.begin(), kept_.end(), [&](const Entry& entry) {
    return entry.upload->header.sha256() == sha256 && entry.upload->tenant == tenant;
  });
}

void PartialUploads::Expire(Entries& dropped) {
  const auto now = options_.now();
  while (!kept_.empty() && now - kept_.back().since >= options_.max_age) {
    dropped.splice(dropped.end(), kept_, std::prev(kept_.end()));
  }
}

uint64_t PartialUploads::CommittedBytes(const std::string& sha256, const std::string& tenant) {
  Entries dropped;
  const std::lock_guard lock(mutex_);
  Expire(dropped);
  const auto found = Find(sha256, tenant);
  return found == kept_.end() ? 0 : found->upload->assembler.received_bytes();
}

absl::StatusOr<std::unique_ptr<PartialUpload>> PartialUploads::Take(
    const v1::ParticleSetDescription& header, const std::string& tenant) {
  Entries dropped;
  const std::lock_guard lock(mutex_);
  Expire(dropped);
  const auto found = Find(header.sha256(), tenant);
  // A header that lies about the layout gets nothing of an honest one's upload.
  const bool fits = found != kept_.end() && ParticlePrefix(found->upload->header.layout()) ==
                                                ParticlePrefix(header.layout());
  const uint64_t committed = fits ? found->upload->assembler.received_bytes() : 0;
  if (header.resume_offset() > committed) {
    return WithCode(absl::StatusCode::kOutOfRange,
                    FieldError("header.resume_offset", fmt::format("{}", header.resume_offset()),
                               fmt::format("at most {}, the bytes kept of this set", committed)));
  }
  std::unique_ptr<PartialUpload> taken = std::move(found->upload);
  kept_.erase(found);
  return taken;
}

void PartialUploads::Keep(std::unique_ptr<PartialUpload> upload) {
  if (upload->assembler.received_bytes() == 0 || options_.max_count == 0 ||
      options_.max_age.count() == 0) {
    return;
  }
  Entries dropped;
  const std::lock_guard lock(mutex_);
  Expire(dropped);
  if (const auto found = Find(upload->header.sha256(), upload->tenant); found != kept_.end()) {
    if (found->upload->assembler.received_bytes() > upload->assembler.received_bytes()) {
      std::swap(found->upload, upload);
    }
    dropped.splice(dropped.end(), kept_, found);
  }
  kept_.push_front({std::move(upload), options_.now()});
  if (kept_.size() > options_.max_count) {
    dropped.splice(dropped.end(), kept_, FirstOfWhoHasMost());
  }
}

// Under the mutex; there is one.
PartialUploads::Entries::iterator PartialUploads::FirstOfWhoHasMost() {
  std::unordered_map<std::string_view, size_t> counts;
  for (const Entry& entry : kept_) {
    ++counts[entry.upload->memory.client()];
  }
  const auto fewer = [](const auto& a, const auto& b) { return a.second < b.second; };
  const size_t most = std::max_element(counts.begin(), counts.end(), fewer)->second;
  const auto first = std::find_if(kept_.rbegin(), kept_.rend(), [&](const Entry& entry) {
    return counts[entry.upload->memory.client()] == most;
  });
  return std::prev(first.base());
}

void PartialUploads::Drop(const std::string& sha256) {
  Entries dropped;
  const std::lock_guard lock(mutex_);
  for (auto entry = kept_.begin(); entry != kept_.end();) {
    const auto next = std::next(entry);
    if (entry->upload->header.sha256() == sha256) {
      dropped.splice(dropped.end(), kept_, entry);
    }
    entry = next;
  }
}

ByteBudget::Growth PartialUploads::Grow(ByteBudget::Share& share, uint64_t bytes) {
  using Growth = ByteBudget::Growth;
  Growth growth = share.Grow(bytes);
  while (growth != Growth::kDone) {
    {
      Entries dropped;
      const std::lock_guard lock(mutex_);
      const auto gives_way = std::find_if(kept_.rbegin(), kept_.rend(), [&](const Entry& entry) {
        return growth == Growth::kFull || entry.upload->memory.client() == share.client();
      });
      if (gives_way == kept_.rend()) {
        break;
      }
      dropped.splice(dropped.end(), kept_, std::prev(gives_way.base()));
    }
    growth = share.Grow(bytes);
  }
  return growth;
}

void PartialUploads::DropExpired() {
  Entries dropped;
  const std::lock_guard lock(mutex_);
  Expire(dropped);
}

size_t PartialUploads::count() const {
  const std::lock_guard lock(mutex_);
  return kept_.size();
}

}  // namespace halflight
