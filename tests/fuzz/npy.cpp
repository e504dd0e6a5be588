// The reader of NPY files.
#include "client/readers/npy.h"

#include "tests/fuzz/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  halflight::fuzz::CheckReader(halflight::client::ReadNpy, data, size);
  return 0;
}
