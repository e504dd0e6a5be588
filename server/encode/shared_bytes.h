// Bytes that several may hold at once without copying them: the last one to let go frees them.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace halflight {

class SharedBytes {
 public:
  SharedBytes() = default;
  explicit SharedBytes(std::string bytes) {
    const auto held = std::make_shared<const std::string>(std::move(bytes));
    view_ = *held;
    owner_ = held;
  }
  // `bytes` stay as they are for as long as somebody holds `owner`.
  SharedBytes(std::shared_ptr<const void> owner, std::string_view bytes)
      : owner_(std::move(owner)), view_(bytes) {}

  [[nodiscard]] std::string_view view() const { return view_; }
  [[nodiscard]] size_t size() const { return view_.size(); }
  [[nodiscard]] const std::shared_ptr<const void>& owner() const { return owner_; }

  // Those from `offset` on, `count` at most; keeps all of them alive.
  [[nodiscard]] SharedBytes Part(size_t offset, size_t count) const {
    return {owner_, view_.substr(offset, count)};
  }

 private:
  std::shared_ptr<const void> owner_;
  std::string_view view_;
};

}  // namespace halflight
