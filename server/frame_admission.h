// Which frames are let in: of the server's places and of its client's, and of the memory that
// frames may take. Knows nothing of what becomes of them.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/byte_budget.h"
#include "server/client_counts.h"
#include "server/pinned_sets.h"

namespace halflight {

struct AdmissionLimits {
  uint32_t max_queued_frames = 64;  // accepted and not yet encoded
  uint32_t max_client_frames = 64;  // of these, of one client
  // Of pixels, and once a frame is encoded of its files, until the frame is sent.
  uint64_t max_frame_bytes = std::numeric_limits<uint64_t>::max();
  // Of these, of one client.
  uint64_t max_client_frame_bytes = std::numeric_limits<uint64_t>::max();
  // Of the particle sets that frames of one client need, until they are encoded.
  uint64_t max_client_set_bytes = std::numeric_limits<uint64_t>::max();
};

// All calls: any thread.
class FrameAdmission {
 public:
  // A frame's part of the memory that frames may take; may outlive the admission.
  class Memory {
   public:
    Memory(std::shared_ptr<ByteBudget> of, const std::string& client)
        : budget_(std::move(of)), share_(*budget_, client) {}

    [[nodiscard]] ByteBudget::Growth Grow(uint64_t bytes) { return share_.Grow(bytes); }
    void ShrinkTo(uint64_t bytes) { share_.ShrinkTo(bytes); }

   private:
    const std::shared_ptr<ByteBudget> budget_;
    ByteBudget::Share share_;
  };

  explicit FrameAdmission(const AdmissionLimits& limits);

  // Whether a frame of this client would find a place now: ResourceExhausted as from Admit.
  [[nodiscard]] absl::Status PlaceFor(const std::string& client) const;
  // A frame that takes up to so much memory: one that takes more than there is for a client is let
  // in once that has nothing else. ResourceExhausted with reason and retry hint.
  absl::StatusOr<std::shared_ptr<Memory>> Admit(const std::string& client, uint64_t bytes,
                                                const PinnedSet& set);
  // Once for each that was let in: it is encoded, or has failed, and leaves its place to another.
  void OnEncoded(const std::string& client, const PinnedSet& set);
  // Then once: nothing is done for it any more.
  void OnEnded();
  // Until every frame that was let in has ended.
  void WaitUntilIdle();

  // Places that are taken.
  [[nodiscard]] uint32_t queued() const;
  // Whether no frame is between Admit and OnEnded.
  [[nodiscard]] bool idle() const;
  // Frames that were ever let in.
  [[nodiscard]] uint64_t accepted() const;
  [[nodiscard]] uint64_t memory_bytes() const { return memory_->used(); }

 private:
  [[nodiscard]] absl::Status FindPlace(const std::string& client) const;

  const AdmissionLimits limits_;
  const std::shared_ptr<ByteBudget> memory_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  ClientCounts queued_;
  PinnedSets pinned_;
  uint32_t under_way_ = 0;
  uint64_t accepted_ = 0;
};

}  // namespace halflight
