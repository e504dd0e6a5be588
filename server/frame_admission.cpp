#include "server/frame_admission.h"

#include <algorithm>

#include <fmt/format.h>

#include "server/error_detail.h"

namespace halflight {

FrameAdmission::FrameAdmission(const AdmissionLimits& limits)
    : limits_(limits),
      memory_(std::make_shared<ByteBudget>(limits.max_frame_bytes, limits.max_client_frame_bytes)) {
}

absl::StatusOr<std::shared_ptr<FrameAdmission::Memory>> FrameAdmission::Admit(
    const std::string& client, uint64_t bytes, const PinnedSet& set) {
  auto memory = std::make_shared<Memory>(memory_, client);
  const std::lock_guard lock(mutex_);
  if (absl::Status place = FindPlace(client); !place.ok()) {
    return place;
  }
  if (const uint64_t pinned = pinned_.BytesWith(client, set);
      pinned > limits_.max_client_set_bytes) {
    return BusyError(
        v1::ERROR_REASON_CACHE_FULL,
        fmt::format("{} bytes of sets with those that this client's frames need", pinned),
        fmt::format("{} bytes for the sets of one client's frames", limits_.max_client_set_bytes));
  }
  const auto growth =
      memory->Grow(std::min({bytes, limits_.max_frame_bytes, limits_.max_client_frame_bytes}));
  if (growth != ByteBudget::Growth::kDone) {
    return BusyError(v1::ERROR_REASON_FRAME_MEMORY_FULL,
                     fmt::format("the frame takes up to {} bytes", bytes),
                     memory_->Allowed(growth, "frames"));
  }
  queued_.Add(client);
  pinned_.Pin(client, set);
  ++under_way_;
  ++accepted_;
  return memory;
}

absl::Status FrameAdmission::PlaceFor(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  return FindPlace(client);
}

// Under the mutex.
absl::Status FrameAdmission::FindPlace(const std::string& client) const {
  if (queued_.total() >= limits_.max_queued_frames) {
    return BusyError(v1::ERROR_REASON_QUEUE_FULL,
                     fmt::format("{} frames are under way", queued_.total()),
                     fmt::format("at most {}", limits_.max_queued_frames));
  }
  if (queued_.Of(client) >= limits_.max_client_frames) {
    return BusyError(v1::ERROR_REASON_CLIENT_QUEUE_FULL,
                     fmt::format("{} frames of this client are under way", queued_.Of(client)),
                     fmt::format("at most {}", limits_.max_client_frames));
  }
  return absl::OkStatus();
}

void FrameAdmission::OnEncoded(const std::string& client, const PinnedSet& set) {
  const std::lock_guard lock(mutex_);
  queued_.Remove(client);
  pinned_.Unpin(client, set);
}

void FrameAdmission::OnEnded() {
  const std::lock_guard lock(mutex_);
  --under_way_;
  ended_.notify_all();
}

void FrameAdmission::WaitUntilIdle() {
  std::unique_lock lock(mutex_);
  ended_.wait(lock, [this] { return under_way_ == 0; });
}

uint32_t FrameAdmission::queued() const {
  const std::lock_guard lock(mutex_);
  return queued_.total();
}

bool FrameAdmission::idle() const {
  const std::lock_guard lock(mutex_);
  return under_way_ == 0;
}

uint64_t FrameAdmission::accepted() const {
  const std::lock_guard lock(mutex_);
  return accepted_;
}

}  // namespace halflight
