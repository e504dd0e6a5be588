#include "tests/fuzz/mutate_request.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "tests/fuzz/mutate_message.h"
#include "tests/fuzz/requests.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace halflight::fuzz {

void MutateRequest(v1::RenderFrameRequest& request, std::minstd_rand& dice) {
  if (dice() % 16 == 0) {
    const std::vector<std::string>& names = NamesOfSets();
    request.mutable_scene()->set_particle_sha256(names[dice() % names.size()]);
  } else {
    MutateMessage(request, dice);
  }
}

std::string MutatedBytes(std::string bytes, size_t max_size) {
  const size_t size = std::min(bytes.size(), max_size);
  bytes.resize(max_size);
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<uint8_t*>(bytes.data()), size, max_size));
  return bytes;
}

size_t Put(const std::string& bytes, uint8_t* data, size_t max_size) {
  const size_t size = std::min(bytes.size(), max_size);
  std::memcpy(data, bytes.data(), size);
  return size;
}

}  // namespace halflight::fuzz
