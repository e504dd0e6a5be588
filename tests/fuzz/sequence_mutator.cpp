// How libFuzzer changes inputs of the target "sequence".
#include <random>
#include <string>
#include <vector>

#include "halflight/v1/service.pb.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/mutate_request.h"

namespace halflight::fuzz {
namespace {

std::string Joined(char server, const std::vector<std::string>& frames) {
  std::string bytes(1, server);
  for (const std::string& frame : frames) {
    bytes += static_cast<char>(frame.size() >> 8U);
    bytes += static_cast<char>(frame.size());
    bytes += frame;
  }
  return bytes;
}

void Mutate(std::vector<std::string>& frames, std::minstd_rand& dice) {
  if (frames.empty() || dice() % 8 == 0) {
    frames.emplace_back();
  }
  const size_t index = dice() % frames.size();
  std::string& frame = frames[index];
  v1::RenderSequenceRequest request;
  if (dice() % 8 == 0) {
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(index));
  } else if (dice() % 8 == 0 || !request.ParseFromString(frame)) {
    frame = MutatedBytes(frame, frame.size() + 16);
  } else {
    MutateRequest(*request.mutable_frame(), dice);
    frame = request.SerializeAsString();
  }
}

}  // namespace
}  // namespace halflight::fuzz

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned int seed) {
  std::minstd_rand dice(seed);
  halflight::fuzz::Input input(data, size);
  auto server = static_cast<char>(input.Byte());
  std::vector<std::string> frames;
  while (!input.empty()) {
    frames.emplace_back(input.Bytes(input.Short()));
  }
  if (dice() % 16 == 0) {
    server = static_cast<char>(dice() % 4);
  }
  do {
    halflight::fuzz::Mutate(frames, dice);
  } while (dice() % 2 == 0);
  return halflight::fuzz::Put(halflight::fuzz::Joined(server, frames), data, max_size);
}
