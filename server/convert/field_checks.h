// Checks of single values, which remember the first that is wrong: conversion walks on over it and
// looks once at the end. Knows nothing of any message.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <fmt/format.h>

#include "absl/status/status.h"
#include "halflight/particle_payload.h"
#include "renderer/field_error.h"

namespace halflight {

// The finite numbers from low to high; an end that is infinite is unbounded.
struct Interval {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool open_low = false;
  bool open_high = false;
  bool server_limit = false;  // `high` is one of ServerLimits: another server may allow more

  [[nodiscard]] bool Contains(double value) const {
    return std::isfinite(value) && (open_low ? value > low : value >= low) &&
           (open_high ? value < high : value <= high);
  }
  // "(0, 179)", "> 0 and finite", "finite".
  [[nodiscard]] std::string ToString() const;
};

inline constexpr Interval kFinite{};
inline constexpr Interval kPositive{.low = 0.0, .open_low = true};
inline constexpr Interval kNotNegative{.low = 0.0};
// Of particles, world units.
inline constexpr Interval kOffset{.low = -kLargestLength, .high = kLargestLength};
inline constexpr Interval kRadius{.low = kSmallestRadius, .high = kLargestLength};

class FieldChecks {
 public:
  // `field` is the path in the request message, such as "scene.camera.width".
  // `server_limit`: the value is beyond one of ServerLimits.
  void Reject(const std::string& field, const std::string& value, const std::string& allowed,
              bool server_limit = false);

  template <typename T>
  T InRange(const std::string& field, T value, const Interval& allowed) {
    if (!allowed.Contains(static_cast<double>(value))) {
      const bool beyond = allowed.server_limit && static_cast<double>(value) > allowed.high;
      Reject(field, fmt::format("{}", value), allowed.ToString(), beyond);
    }
    return value;
  }

  // Of integers where 0 stands for unset.
  uint32_t InRangeOr(const std::string& field, uint32_t value, uint32_t unset,
                     const Interval& allowed);

  [[nodiscard]] bool ok() const { return status_.ok(); }
  // The first error.
  [[nodiscard]] const absl::Status& status() const { return status_; }

 private:
  absl::Status status_;
};

}  // namespace halflight
