// SHA-256, which names particle sets and seals outputs.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace halflight {

inline constexpr size_t kSha256Bytes = 32;

class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void Update(std::string_view bytes);
  // The 32 bytes of the digest of everything seen. Valid once.
  std::string Finish();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

std::string Sha256Of(std::string_view bytes);

// Lower-case hexadecimal, for people, logs and metadata.
std::string ToHex(std::string_view bytes);

}  // namespace halflight
