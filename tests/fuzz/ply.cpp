// The reader of PLY files.
#include "client/readers/ply.h"

#include "tests/fuzz/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  halflight::fuzz::CheckReader(halflight::client::ReadPly, data, size);
  return 0;
}
