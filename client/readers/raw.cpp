#include "client/readers/raw.h"

#include <fmt/format.h>

#include <bit>
#include <optional>
#include <vector>

#include "client/readers/scalar.h"

namespace halflight::client {

absl::StatusOr<Columns> ReadRaw(std::string_view bytes) {
  constexpr size_t kParticleBytes = 4 * sizeof(float);
  const size_t count = bytes.size() / kParticleBytes;
  if (bytes.size() % kParticleBytes != 0) {
    return absl::DataLossError(
        fmt::format("byte {}: expected {} bytes of particle {} (x y z radius as float4), found {} "
                    "to the end of the file",
                    count * kParticleBytes, kParticleBytes, count, bytes.size() % kParticleBytes));
  }
  const std::vector<std::optional<Column>> columns = {
      Column{Attribute::kPosition, 0}, Column{Attribute::kPosition, 1},
      Column{Attribute::kPosition, 2}, Column{Attribute::kRadius, 0}};
  Columns values;
  values.Resize(count, columns);
  for (size_t i = 0; i < 4 * count; ++i) {
    values.Set(i / 4, *columns[i % 4],
               LoadScalar(&bytes[i * sizeof(float)], ScalarType::kFloat32, std::endian::little));
  }
  return values;
}

}  // namespace halflight::client
