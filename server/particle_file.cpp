#include "server/particle_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <vector>

#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include "halflight/particle_payload.h"
#include "server/particle_assembler.h"
#include "server/status_text.h"

namespace halflight {
namespace {

constexpr size_t kReadBytes = size_t{1} << 20U;

template <typename T>
std::string_view BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// In the order of kAttributeFormats.
std::array<std::string_view, kAttributeFormats.size()> ArraysOf(const ParticleSet& set) {
  return {BytesOf(set.positions), BytesOf(set.radii),      BytesOf(set.opacities),
          BytesOf(set.colors),    BytesOf(set.velocities), BytesOf(set.emissions)};
}

absl::Status WriteAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written <= 0) {
      return SystemError(written == 0 ? ENOSPC : errno, "write");
    }
    bytes.remove_prefix(static_cast<size_t>(written));
  }
  return absl::OkStatus();
}

// The next bytes of the file; fewer than asked for at its end.
absl::StatusOr<std::string_view> ReadSome(int fd, std::string& buffer, uint64_t bytes) {
  buffer.resize(std::min<uint64_t>(bytes, kReadBytes));
  size_t filled = 0;
  while (filled < buffer.size()) {
    const ssize_t count = read(fd, buffer.data() + filled, buffer.size() - filled);
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count < 0) {
      return SystemError(errno, "read");
    }
    if (count == 0) {
      break;
    }
    filled += static_cast<size_t>(count);
  }
  return std::string_view(buffer.data(), filled);
}

}  // namespace

absl::Status SystemError(int error, const std::string& what) {
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  return {full ? absl::StatusCode::kResourceExhausted : absl::StatusCode::kUnavailable,
          fmt::format("{}: {}", what, std::strerror(error))};
}

uint64_t ParticleFileBytes(const ParticleSet& set) {
  uint64_t bytes = kParticlePrefixBytes;
  for (const std::string_view array : ArraysOf(set)) {
    bytes += array.size();
  }
  return bytes;
}

absl::Status WriteParticleFile(const ParticleSet& set, int fd) {
  const auto arrays = ArraysOf(set);
  v1::ParticleLayout layout;
  layout.set_count(set.size());
  for (size_t i = 0; i < arrays.size(); ++i) {
    if (!arrays[i].empty()) {
      layout.add_attributes(kAttributeFormats[i].attribute);
    }
  }
  layout.mutable_origin()->set_x(set.origin.x);
  layout.mutable_origin()->set_y(set.origin.y);
  layout.mutable_origin()->set_z(set.origin.z);
  absl::Status status = WriteAll(fd, ParticlePrefix(layout));
  for (const std::string_view array : arrays) {
    if (status.ok()) {
      status = WriteAll(fd, array);
    }
  }
  return status;
}

absl::StatusOr<std::shared_ptr<const ParticleSet>> ReadParticleFile(int fd,
                                                                    const std::string& sha256,
                                                                    const ServerLimits& limits) {
  struct stat info {};
  if (fstat(fd, &info) != 0) {
    return SystemError(errno, "fstat");
  }
  std::string buffer;
  const auto prefix = ReadSome(fd, buffer, kParticlePrefixBytes);
  if (!prefix.ok()) {
    return prefix.status();
  }
  const auto layout = ParseParticlePrefix(*prefix);
  if (!layout.has_value()) {
    return absl::DataLossError("it does not begin as a particle set");
  }
  const auto payload_bytes = CheckedPayloadBytes(*layout, "layout", limits);
  if (!payload_bytes.ok()) {
    return absl::DataLossError(MessageOf(payload_bytes.status()));
  }
  const uint64_t expected = kParticlePrefixBytes + *payload_bytes;
  if (static_cast<uint64_t>(info.st_size) != expected) {
    return absl::DataLossError(
        fmt::format("it has {} bytes where {} are announced", info.st_size, expected));
  }
  ParticleAssembler assembler(*layout, *payload_bytes);
  while (assembler.received_bytes() < *payload_bytes) {
    const auto bytes = ReadSome(fd, buffer, *payload_bytes - assembler.received_bytes());
    if (!bytes.ok()) {
      return bytes.status();
    }
    if (bytes->empty()) {
      return absl::DataLossError("it ended while it was read");
    }
    if (const absl::Status status = assembler.Append(*bytes); !status.ok()) {
      return absl::DataLossError(MessageOf(status));
    }
  }
  NamedParticles particles = assembler.Finish();
  if (particles.sha256 != sha256) {
    return absl::DataLossError(fmt::format("its SHA-256 is {}", ToHex(particles.sha256)));
  }
  return std::move(particles.set);
}

}  // namespace halflight
