// How many of something there are, and how many of them each client has. Whoever uses it locks it.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

namespace halflight {

class ClientCounts {
 public:
  [[nodiscard]] uint32_t total() const { return total_; }
  [[nodiscard]] uint32_t Of(const std::string& client) const {
    const auto own = of_.find(client);
    return own == of_.end() ? 0 : own->second;
  }

  void Add(const std::string& client) {
    ++total_;
    ++of_[client];
  }
  // One that was added.
  void Remove(const std::string& client) {
    --total_;
    const auto own = of_.find(client);
    if (--own->second == 0) {
      of_.erase(own);
    }
  }

 private:
  uint32_t total_ = 0;
  std::unordered_map<std::string, uint32_t> of_;  // none at 0
};

}  // namespace halflight
