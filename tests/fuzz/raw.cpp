// The reader of raw files.
#include "client/readers/raw.h"

#include "tests/fuzz/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  halflight::fuzz::CheckReader(halflight::client::ReadRaw, data, size);
  return 0;
}
