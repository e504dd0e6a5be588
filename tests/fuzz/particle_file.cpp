// Files of the cache directory: the first byte says whether the file has the name that its content
// asks for, the rest is the file.
#include <cstddef>
#include <cstdint>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include "halflight/sha256.h"
#include "server/particle_file.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/require.h"

namespace halflight::fuzz {
namespace {

// Never anything but memory, and used again.
void Fill(int file, std::string_view bytes) {
  Require(ftruncate(file, 0) == 0 && lseek(file, 0, SEEK_SET) == 0 &&
              write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()) &&
              lseek(file, 0, SEEK_SET) == 0,
          "a file in memory can be written");
}

std::string ContentOf(int file) {
  std::string bytes(static_cast<size_t>(lseek(file, 0, SEEK_END)), '\0');
  Require(pread(file, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()),
          "a file in memory can be read");
  return bytes;
}

void Check(Input input) {
  static const int file = memfd_create("read", MFD_CLOEXEC);
  static const int copy = memfd_create("written", MFD_CLOEXEC);
  const bool named_wrong = input.Byte() % 2 == 1;
  const std::string_view bytes = input.Rest();
  Sha256 digest;
  digest.Update(bytes);
  std::string sha256 = digest.Finish();
  if (named_wrong) {
    sha256.back() = static_cast<char>(sha256.back() ^ 1);
  }
  Fill(file, bytes);
  const auto set = ReadParticleFile(file, sha256, ServerLimits{});
  if (!set.ok()) {
    Require(absl::IsDataLoss(set.status()), "what cannot be a set counts as damaged");
    return;
  }
  Require(!named_wrong, "a set of another name is refused");
  Require((*set)->size() == 0 || ParticleFileBytes(**set) == bytes.size(), "the size is known");
  if ((*set)->size() > 0) {
    Fill(copy, "");
    Require(WriteParticleFile(**set, copy).ok(), "a set can be written");
    Require(ContentOf(copy) == bytes, "a set is written as it was read");
  }
}

}  // namespace
}  // namespace halflight::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  halflight::fuzz::Check({data, size});
  return 0;
}
