#include "renderer/device_fault.h"

#include <array>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

namespace halflight {

namespace {

constexpr char kFaultPayload[] = "halflight/device-reset";
constexpr char kSuspect[] = "suspect";

constexpr std::array<std::pair<const char*, DeviceFault>, 6> kKinds = {
    {{"reset", DeviceFault::kReset},
     {"innocent-reset", DeviceFault::kInnocentReset},
     {"gone", DeviceFault::kGone},
     {"out-of-memory", DeviceFault::kOutOfMemory},
     {"hang", DeviceFault::kHang},
     {"late", DeviceFault::kLate}}};

}  // namespace

absl::Status DeviceResetError(bool innocent) {
  absl::Status status = absl::UnavailableError(
      innocent ? "the device was reset while it drew the frame, for another reason"
               : "the device was reset while it drew the frame");
  status.SetPayload(kFaultPayload, absl::Cord(innocent ? "innocent" : kSuspect));
  return status;
}

absl::Status DeviceGoneError(const absl::Status& why) {
  return absl::UnavailableError(
      absl::StrCat("the device was lost and cannot be had again: ", why.message()));
}

bool IsDeviceReset(const absl::Status& status) {
  return status.GetPayload(kFaultPayload).has_value();
}

bool IsSuspect(const absl::Status& status) {
  const auto payload = status.GetPayload(kFaultPayload);
  return payload.has_value() && *payload == kSuspect;
}

absl::StatusOr<PlannedFaults> PlannedFaults::Parse(const std::string& text) {
  PlannedFaults faults;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    const std::pair<std::string, std::string> halves =
        absl::StrSplit(part, absl::MaxSplits(':', 1));
    const std::pair<std::string, std::string> ends =
        absl::StrSplit(halves.second, absl::MaxSplits('-', 1));
    Planned planned;
    for (const auto& [name, fault] : kKinds) {
      if (halves.first == name) planned.fault = fault;
    }
    bool good = planned.fault != DeviceFault::kNone &&
                absl::SimpleAtoi(ends.first, &planned.first) && planned.first > 0;
    if (halves.second.find('-') == std::string::npos) {
      planned.last = planned.first;
    } else if (!ends.second.empty()) {
      good &= absl::SimpleAtoi(ends.second, &planned.last) && planned.last >= planned.first;
    }
    if (!good) {
      return absl::InvalidArgumentError(
          absl::StrCat("\"", part,
                       "\", allowed: <kind>:<drawing>[-[<last>]] with kind reset, innocent-reset, "
                       "gone, out-of-memory, hang or late"));
    }
    faults.planned_.push_back(planned);
  }
  return faults;
}

DeviceFault PlannedFaults::Next() {
  ++drawings_;
  for (const Planned& planned : planned_) {
    if (drawings_ >= planned.first && drawings_ <= planned.last) {
      gone_ |= planned.fault == DeviceFault::kGone;
      return planned.fault;
    }
  }
  return DeviceFault::kNone;
}

}  // namespace halflight
