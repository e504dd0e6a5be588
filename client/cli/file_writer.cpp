#include "client/cli/file_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace halflight::client {

namespace {

namespace fs = std::filesystem;

// Of temporary files, tried before the directory is given up.
constexpr int kMostNames = 1000;

absl::Status Failed(const std::string& path, const char* what, const std::string& reason) {
  return absl::UnknownError(fmt::format("{}: cannot be {}: {}", path, what, reason));
}

// Negative: errno says why not.
int Open(const std::string& path, int flags) {
  return open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, 0666);
}

// Writes and closes what Open gave: 0, or errno.
int WriteTo(int fd, std::string_view bytes) {
  if (fd < 0) {
    return errno;
  }
  int error = 0;
  while (!bytes.empty() && error == 0) {
    const ssize_t written = write(fd, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<size_t>(written));
    } else if (errno != EINTR) {
      error = errno;
    }
  }
  // What a full disk or a lost share refuses may show only now.
  if (close(fd) != 0 && error == 0) {
    error = errno;
  }
  return error;
}

}  // namespace

absl::Status PrepareDirectoryOf(const std::string& path) {
  const fs::path directory = fs::path(path).parent_path();
  std::error_code error;
  if (!directory.empty() && !fs::is_directory(directory, error)) {
    fs::create_directories(directory, error);
    if (error) {
      return Failed(directory.string(), "created", error.message());
    }
  }
  if (fs::is_directory(path, error)) {
    return Failed(path, "written", "it is a directory");
  }
  // Files are made beside their name and moved there; devices and pipes are written to directly.
  const bool in_place = fs::exists(path, error) && !fs::is_regular_file(path, error);
  const std::string target =
      in_place ? path : (directory.empty() ? fs::path(".") : directory).string();
  if (access(target.c_str(), W_OK) != 0) {
    return Failed(path, "written", std::strerror(errno));
  }
  return absl::OkStatus();
}

absl::Status WriteFileWhole(const std::string& path, std::string_view bytes) {
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    const int error = WriteTo(Open(path, O_TRUNC), bytes);
    return error == 0 ? absl::OkStatus() : Failed(path, "written", std::strerror(error));
  }
  // Another process of the same number, on another machine, may write there too, or have left one.
  const fs::path target(path);
  std::string temporary;
  int fd = -1;
  for (int i = 0; i < kMostNames && fd < 0 && (i == 0 || errno == EEXIST); ++i) {
    temporary = (target.parent_path() /
                 fmt::format(".{}.{}.{}.tmp", target.filename().string(), getpid(), i))
                    .string();
    fd = Open(temporary, O_EXCL);
  }
  const bool created = fd >= 0;
  int error = WriteTo(fd, bytes);
  if (error == 0 && std::rename(temporary.c_str(), path.c_str()) != 0) {
    error = errno;
  }
  if (error != 0) {
    if (created) {
      unlink(temporary.c_str());
    }
    return Failed(path, "written", std::strerror(error));
  }
  return absl::OkStatus();
}

}  // namespace halflight::client
