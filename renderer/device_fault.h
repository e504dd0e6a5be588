// Devices that fail: how a renderer says so, and how tests make a sound one do it.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace halflight {

// Unavailable: the device was reset under the frame, and whoever gets this must make another
// renderer. `innocent`: something else was the cause, such as another process.
absl::Status DeviceResetError(bool innocent);
// Unavailable, of frames that come after the device could not be had again.
absl::Status DeviceGoneError(const absl::Status& why);

bool IsDeviceReset(const absl::Status& status);
// Whether the frame may have been the cause of a reset.
bool IsSuspect(const absl::Status& status);

// Longer than it takes to cancel a frame and to ask for another, on a machine with much to do.
inline constexpr std::chrono::milliseconds kLateness(2000);

enum class DeviceFault : uint8_t {
  kNone,
  kReset,          // by what is drawn
  kInnocentReset,  // by somebody else
  kGone,           // reset, and never to be had again
  kOutOfMemory,
  kHang,  // for ever
  kLate,  // at it for kLateness more, whatever the frame
};

// Faults of a device that is sound. Drawings are numbered from 1 on, over all renderers that share
// the object; a frame is drawn a second time when there was no memory for it. One thread.
class PlannedFaults {
 public:
  // "reset:2,out-of-memory:4-5": at the second drawing and at the fourth and fifth; "reset:2-" from
  // the second on. Kinds: reset, innocent-reset, gone, out-of-memory, hang, late.
  // InvalidArgument.
  static absl::StatusOr<PlannedFaults> Parse(const std::string& text);

  // What befalls the next drawing.
  DeviceFault Next();
  // Whether the device can be had, as far as the plan goes.
  [[nodiscard]] bool gone() const { return gone_; }

 private:
  struct Planned {
    DeviceFault fault = DeviceFault::kNone;
    uint64_t first = 1;
    uint64_t last = std::numeric_limits<uint64_t>::max();
  };

  std::vector<Planned> planned_;
  uint64_t drawings_ = 0;
  bool gone_ = false;
};

}  // namespace halflight
