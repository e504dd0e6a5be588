// A number of bytes shared by several users, given out first come, first served. Allocates nothing
// itself and never waits: what does not fit is refused.
#pragma once

#include <atomic>
#include <cstdint>

namespace halflight {

class ByteBudget {
 public:
  explicit ByteBudget(uint64_t total) : total_(total), left_(total) {}

  // A share of the budget, given back when it goes out of scope. Grows under one user only; the
  // budget must outlive it.
  class Share {
   public:
    explicit Share(ByteBudget& budget) : budget_(budget) {}
    ~Share() { Release(); }
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;
    Share(Share&&) = delete;
    Share& operator=(Share&&) = delete;

    // False, and nothing changed, where the budget has less than this left.
    [[nodiscard]] bool Grow(uint64_t bytes) {
      uint64_t left = budget_.left_.load();
      do {
        if (bytes > left) {
          return false;
        }
      } while (!budget_.left_.compare_exchange_weak(left, left - bytes));
      taken_ += bytes;
      return true;
    }

    // Gives back what is beyond `bytes`.
    void ShrinkTo(uint64_t bytes) {
      if (bytes < taken_) {
        budget_.left_ += taken_ - bytes;
        taken_ = bytes;
      }
    }

    void Release() { ShrinkTo(0); }

   private:
    ByteBudget& budget_;
    uint64_t taken_ = 0;
  };

  [[nodiscard]] uint64_t total() const { return total_; }
  [[nodiscard]] uint64_t left() const { return left_; }
  [[nodiscard]] uint64_t used() const { return total_ - left_; }

 private:
  const uint64_t total_;
  std::atomic<uint64_t> left_;
};

}  // namespace halflight
