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
  if (!Fits(client, bytes)) {
    return Growth::kClientFull;
  }
  if (bytes > total_ - used_) {
    return Growth::kFull;
  }
  used_ += bytes;
  Charge(client, bytes);
  return Growth::kDone;
}

void ByteBudget::GiveBack(const std::string& client, uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  used_ -= bytes;
  Discharge(client, bytes);
}

bool ByteBudget::Move(const std::string& from, const std::string& to, uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (from == to || !Fits(to, bytes)) {
    return false;
  }
  Discharge(from, bytes);
  Charge(to, bytes);
  return true;
}

bool ByteBudget::Fits(const std::string& client, uint64_t bytes) const {
  const auto own = used_by_.find(client);
  return bytes <= each_ - (own == used_by_.end() ? 0 : own->second);
}

void ByteBudget::Charge(const std::string& client, uint64_t bytes) {
  if (bytes > 0) {
    used_by_[client] += bytes;
  }
}

void ByteBudget::Discharge(const std::string& client, uint64_t bytes) {
  const auto own = used_by_.find(client);
  if (own != used_by_.end() && (own->second -= bytes) == 0) {
    used_by_.erase(own);
  }
}

}  // namespace halflight
