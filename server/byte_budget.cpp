#include "server/byte_budget.h"

#include <fmt/format.h>

namespace halflight {

uint64_t ByteBudget::used() const {
  const std::lock_guard lock(mutex_);
  return used_;
}

std::string ByteBudget::Allowed(Growth growth, std::string_view users) const {
  return growth == Growth::kClientFull
             ? fmt::format("{} bytes for all {} of one client", each_, users)
             : fmt::format("{} bytes for all {}, of which {} are left", total_, users, left());
}

ByteBudget::Growth ByteBudget::Take(const std::string& client, uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  const auto own = used_by_.find(client);
  if (bytes > each_ - (own == used_by_.end() ? 0 : own->second)) {
    return Growth::kClientFull;
  }
  if (bytes > total_ - used_) {
    return Growth::kFull;
  }
  if (bytes > 0) {
    used_ += bytes;
    used_by_[client] += bytes;
  }
  return Growth::kDone;
}

void ByteBudget::GiveBack(const std::string& client, uint64_t bytes) {
  if (bytes == 0) {
    return;
  }
  const std::lock_guard lock(mutex_);
  used_ -= bytes;
  const auto own = used_by_.find(client);
  own->second -= bytes;
  if (own->second == 0) {
    used_by_.erase(own);
  }
}

}  // namespace halflight
