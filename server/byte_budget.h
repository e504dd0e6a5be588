// A number of bytes shared by clients, given out first come, first served, to each of them so much
// at most. Never waits: what does not fit is refused.
#pragma once

#include <cstdint>
#include <limits>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace halflight {

// All calls: any thread.
class ByteBudget {
 public:
  enum class Growth {
    kDone,
    kClientFull,  // less than that is left for this client
    kFull,        // for this client enough, for all not
  };

  explicit ByteBudget(uint64_t total, uint64_t each = std::numeric_limits<uint64_t>::max())
      : total_(total), each_(each) {}

  // Part of what a client has of the budget, given back when it goes out of scope. Used by one
  // thread at a time; the budget must outlive it.
  class Share {
   public:
    explicit Share(ByteBudget& budget, std::string client = "")
        : budget_(budget), client_(std::move(client)) {}
    ~Share() { Release(); }
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;
    Share(Share&&) = delete;
    Share& operator=(Share&&) = delete;

    [[nodiscard]] const std::string& client() const { return client_; }

    // Nothing has changed unless it is kDone.
    [[nodiscard]] Growth Grow(uint64_t bytes) {
      const Growth growth = budget_.Take(client_, bytes);
      if (growth == Growth::kDone) {
        taken_ += bytes;
      }
      return growth;
    }

    // From now on it is this client's; unless that one has too much, when nothing changes.
    void PassTo(const std::string& client) {
      if (budget_.Move(client_, client, taken_)) {
        client_ = client;
      }
    }

    // Gives back what is beyond `bytes`.
    void ShrinkTo(uint64_t bytes) {
      if (bytes < taken_) {
        budget_.GiveBack(client_, taken_ - bytes);
        taken_ = bytes;
      }
    }

    void Release() { ShrinkTo(0); }

   private:
    ByteBudget& budget_;
    std::string client_;
    uint64_t taken_ = 0;
  };

  [[nodiscard]] uint64_t used() const;
  [[nodiscard]] uint64_t left() const { return total_ - used(); }
  // What is allowed, as errors say it. `growth`: not kDone; `users`: as in "uploads".
  [[nodiscard]] std::string Allowed(Growth growth, std::string_view users) const;

 private:
  Growth Take(const std::string& client, uint64_t bytes);
  void GiveBack(const std::string& client, uint64_t bytes);
  bool Move(const std::string& from, const std::string& to, uint64_t bytes);
  // Under the mutex. The first: whether there is room for them.
  [[nodiscard]] bool Fits(const std::string& client, uint64_t bytes) const;
  void Charge(const std::string& client, uint64_t bytes);
  void Discharge(const std::string& client, uint64_t bytes);

  const uint64_t total_;
  const uint64_t each_;
  mutable std::mutex mutex_;
  uint64_t used_ = 0;
  std::unordered_map<std::string, uint64_t> used_by_;  // none at 0
};

}  // namespace halflight
