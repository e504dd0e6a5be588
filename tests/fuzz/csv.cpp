// The reader of CSV files.
#include "client/readers/csv.h"

#include "tests/fuzz/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  halflight::fuzz::CheckReader(halflight::client::ReadCsv, data, size);
  return 0;
}
