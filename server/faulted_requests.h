// Which requests the device has failed under, so that one that kills it is not drawn for ever.
#pragma once

#include <cstddef>
#include <list>
#include <mutex>
#include <string>
#include <unordered_map>

namespace halflight {

// All calls: any thread.
class FaultedRequests {
 public:
  // Of so many requests at most: that which failed longest ago is forgotten first.
  static constexpr size_t kMost = 1024;
  // From how many failures on a request is refused.
  static constexpr int kTooMany = 2;

  // The device was reset under a request of this fingerprint.
  void Blame(const std::string& fingerprint);

  // How often it was.
  [[nodiscard]] int Count(const std::string& fingerprint) const;

 private:
  struct Entry {
    int count = 0;
    std::list<std::string>::iterator place;
  };

  mutable std::mutex mutex_;
  std::list<std::string> latest_first_;
  std::unordered_map<std::string, Entry> entries_;
};

}  // namespace halflight
