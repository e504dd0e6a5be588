// How libFuzzer changes inputs of the target "request".
#include <random>
#include <string>

#include "halflight/v1/service.pb.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/mutate_request.h"

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned int seed) {
  using namespace halflight;  // NOLINT(google-build-using-namespace)
  std::minstd_rand dice(seed);
  fuzz::Input input(data, size);
  auto server = static_cast<char>(input.Byte());
  const std::string bytes(input.Rest());
  if (dice() % 16 == 0) {
    server = static_cast<char>(dice() % 4);
  }
  v1::RenderFrameRequest request;
  if (dice() % 8 == 0 || !request.ParseFromString(bytes)) {
    return fuzz::Put(server + fuzz::MutatedBytes(bytes, max_size - 1), data, max_size);
  }
  // Several at once now and then, since some are refused alone.
  do {
    fuzz::MutateRequest(request, dice);
  } while (dice() % 2 == 0);
  return fuzz::Put(server + request.SerializeAsString(), data, max_size);
}
