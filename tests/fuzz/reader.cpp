#include "tests/fuzz/reader.h"

#include <string>
#include <utility>

#include "client/particles.h"
#include "server/limits.h"
#include "server/particle_assembler.h"
#include "tests/fuzz/allocation_limit.h"
#include "tests/fuzz/require.h"

namespace halflight::fuzz {
namespace {

// The worst is a CSV file whose columns have no names: a comma is a string in two vectors, each
// twice while it grows.
constexpr size_t kHeldPerByte = 256;
constexpr size_t kHeldAtLeast = size_t{64} << 10U;

}  // namespace

void CheckReader(absl::StatusOr<client::Columns> (*read)(std::string_view bytes),
                 const uint8_t* data, size_t size) {
  const AllocationLimit limit(kHeldAtLeast + kHeldPerByte * size);
  auto columns = read({reinterpret_cast<const char*>(data), size});
  if (!columns.ok()) {
    Require(!columns.status().message().empty(), "a refusal has words");
    return;
  }
  const auto particles = client::ParticlesFromColumns(*std::move(columns));
  if (!particles.ok()) {
    Require(!particles.status().message().empty(), "a refusal has words");
    return;
  }
  const client::EncodedParticles encoded = client::EncodeParticles(*particles);
  const auto bytes = CheckedPayloadBytes(encoded.layout, "layout", ServerLimits{});
  Require(bytes.ok(), "the server takes the layout: " + bytes.status().ToString());
  Require(*bytes == encoded.payload.size(), "the payload is as long as the layout asks for");
  ParticleAssembler assembler(encoded.layout, *bytes);
  const absl::Status status = assembler.Append(encoded.payload);
  Require(status.ok(), "the server takes the values: " + status.ToString());
  Require(assembler.Finish().sha256 == encoded.sha256, "client and server name the set alike");
}

}  // namespace halflight::fuzz
