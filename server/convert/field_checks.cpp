#include "server/convert/field_checks.h"

#include <cmath>

#include "server/error_detail.h"

namespace halflight {

std::string Interval::ToString() const {
  if (std::isfinite(low) && std::isfinite(high)) {
    return fmt::format("{}{}, {}{}", open_low ? '(' : '[', low, high, open_high ? ')' : ']');
  }
  if (std::isfinite(low)) {
    return fmt::format("{} {} and finite", open_low ? ">" : ">=", low);
  }
  return "finite";
}

void FieldChecks::Reject(const std::string& field, const std::string& value,
                         const std::string& allowed, bool server_limit) {
  if (status_.ok()) {
    status_ = server_limit ? LimitError(field, value, allowed) : FieldError(field, value, allowed);
  }
}

uint32_t FieldChecks::InRangeOr(const std::string& field, uint32_t value, uint32_t unset,
                                const Interval& allowed) {
  return value == 0 ? unset : InRange(field, value, allowed);
}

}  // namespace halflight
