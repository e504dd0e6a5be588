#include "client/readers/reader.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include "absl/strings/ascii.h"
#include "client/readers/columns.h"
#include "client/readers/csv.h"
#include "client/readers/npy.h"
#include "client/readers/ply.h"
#include "client/readers/raw.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

struct Format {
  const char* name;
  const char* extension;  // empty: only by name
  absl::StatusOr<Columns> (*read)(std::string_view bytes);
};
constexpr std::array<Format, 4> kFormats = {{
    {"ply", ".ply", ReadPly},
    {"csv", ".csv", ReadCsv},
    {"npy", ".npy", ReadNpy},
    {"raw", "", ReadRaw},
}};

absl::StatusOr<const Format*> ChooseFormat(const std::string& path, std::string_view name) {
  const std::string extension =
      absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  for (const Format& format : kFormats) {
    if (name.empty() ? !extension.empty() && extension == format.extension : name == format.name) {
      return &format;
    }
  }
  return absl::InvalidArgumentError(
      name.empty() ? fmt::format("file extension is '{}'; allowed: .ply, .csv, .npy, or any with "
                                 "the format given ({})",
                                 extension, FormatNames())
                   : fmt::format("format is '{}'; allowed: {}", name, FormatNames()));
}

absl::StatusOr<std::string> ReadBytes(const std::string& path) {
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  const std::unique_ptr<std::FILE, Closer> file(std::fopen(path.c_str(), "rb"));
  if (file == nullptr) {
    const char* reason = std::strerror(errno);
    return errno == ENOENT ? absl::NotFoundError(reason) : absl::PermissionDeniedError(reason);
  }
  std::string bytes;
  struct stat status {};
  if (fstat(fileno(file.get()), &status) == 0) {
    if (S_ISDIR(status.st_mode)) {
      return absl::InvalidArgumentError("expected a file, found a directory");
    }
    bytes.reserve(static_cast<size_t>(status.st_size));
  }
  std::array<char, 65536> buffer;
  while (const size_t got = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
    bytes.append(buffer.data(), got);
  }
  if (std::ferror(file.get()) != 0) {
    return absl::DataLossError(fmt::format("cannot be read after byte {}", bytes.size()));
  }
  return bytes;
}

absl::Status InFile(const std::string& path, const absl::Status& status) {
  return absl::Status(status.code(), fmt::format("{}: {}", path, MessageOf(status)));
}

absl::StatusOr<Particles> Parse(const std::string& path, std::string_view format) {
  const auto chosen = ChooseFormat(path, format);
  if (!chosen.ok()) {
    return chosen.status();
  }
  const auto bytes = ReadBytes(path);
  if (!bytes.ok()) {
    return bytes.status();
  }
  auto columns = (*chosen)->read(*bytes);
  if (!columns.ok()) {
    return columns.status();
  }
  return ParticlesFromColumns(*std::move(columns));
}

// How the standard library tells that bytes do not fit into the memory.
absl::Status TooLarge(const std::exception& error) {
  return absl::ResourceExhaustedError(fmt::format("does not fit into memory ({})", error.what()));
}

}  // namespace

absl::StatusOr<Particles> ReadParticles(const std::string& path, std::string_view format) {
  absl::StatusOr<Particles> particles;
  try {
    particles = Parse(path, format);
  } catch (const std::bad_alloc& error) {
    particles = TooLarge(error);
  } catch (const std::length_error& error) {
    particles = TooLarge(error);
  }
  return particles.ok() ? std::move(particles) : InFile(path, particles.status());
}

std::string FormatNames() {
  std::string names;
  for (const Format& format : kFormats) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", format.name);
  }
  return names;
}

}  // namespace halflight::client
