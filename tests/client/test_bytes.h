// Builds the bytes of particle files for the tests of readers, in either byte order.
#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/status_text.h"

namespace halflight::client {

template <typename T>
std::string Bytes(T value, std::endian order = std::endian::little) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof(T));
  if (order != std::endian::native) {
    std::reverse(bytes.begin(), bytes.end());
  }
  return bytes;
}

// A new directory that goes with the object.
class TestDirectory {
 public:
  TestDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "halflight-test-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  TestDirectory(const TestDirectory&) = delete;
  TestDirectory& operator=(const TestDirectory&) = delete;
  ~TestDirectory() { std::filesystem::remove_all(path_); }

  // The path of a file in it.
  [[nodiscard]] std::string operator/(const std::string& name) const {
    return (path_ / name).string();
  }
  std::string Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return *this / name;
  }

 private:
  std::filesystem::path path_;
};

// That a status has a code, and each of some texts in its message.
inline void ExpectError(const absl::Status& status, absl::StatusCode code,
                        const std::vector<std::string>& texts) {
  EXPECT_EQ(status.code(), code) << status;
  for (const std::string& text : texts) {
    EXPECT_THAT(MessageOf(status), testing::HasSubstr(text));
  }
}

}  // namespace halflight::client
