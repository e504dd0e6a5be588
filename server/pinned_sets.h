// Which particle sets the frames of each client keep in memory, and how much that is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "renderer/scene.h"

namespace halflight {

// A set that a frame holds.
struct PinnedSet {
  const ParticleSet* set = nullptr;
  uint64_t bytes = 0;
};

// Whoever uses it locks it.
class PinnedSets {
 public:
  // Bytes of the sets that a client would pin with one more frame that needs this one: each counts
  // once, however many frames need it.
  [[nodiscard]] uint64_t BytesWith(const std::string& client, const PinnedSet& set) const {
    uint64_t bytes = 0;
    if (const auto own = of_.find(client); own != of_.end()) {
      for (const auto& [pinned, pins] : own->second) {
        bytes += pinned == set.set ? 0 : pins.bytes;
      }
    }
    return bytes + set.bytes;
  }

  void Pin(const std::string& client, const PinnedSet& set) {
    Pins& pins = of_[client][set.set];
    pins.bytes = set.bytes;
    ++pins.frames;
  }
  // One that was pinned.
  void Unpin(const std::string& client, const PinnedSet& set) {
    const auto own = of_.find(client);
    const auto pins = own->second.find(set.set);
    if (--pins->second.frames == 0) {
      own->second.erase(pins);
    }
    if (own->second.empty()) {
      of_.erase(own);
    }
  }

 private:
  struct Pins {
    uint64_t bytes = 0;
    size_t frames = 0;
  };
  std::map<std::string, std::map<const ParticleSet*, Pins>> of_;  // no client or set without frames
};

}  // namespace halflight
