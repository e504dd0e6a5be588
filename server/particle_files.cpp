#include "server/particle_files.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <optional>
#include <tuple>
#include <utility>

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <fmt/format.h>

#include "absl/strings/escaping.h"
#include "halflight/sha256.h"
#include "server/error_detail.h"
#include "server/log/log.h"
#include "server/particle_file.h"
#include "server/status_text.h"

namespace halflight {
namespace {

constexpr char kLockName[] = "halflightd.lock";
constexpr char kSuffix[] = ".particles";
constexpr char kTemporarySuffix[] = ".particles.writing";

// What a file takes on disk: that of a set of few particles is far larger than the set.
constexpr uint64_t kBlock = 4096;
uint64_t BlockBytes(uint64_t bytes) { return (bytes + kBlock - 1) / kBlock * kBlock; }

// The set stays in memory only.
void LogNotWritten(const std::string& sha256, const std::string& why) {
  Log(LogLevel::kWarn, "cache_dir_not_written", {{"set", ToHex(sha256)}, {"message", why}});
}

std::string FileName(const std::string& sha256) { return ToHex(sha256) + kSuffix; }

// The set whose file has this name; none of other files.
std::optional<std::string> NameOfSet(const std::string& file, const std::string& suffix) {
  constexpr size_t kHexBytes = 2 * kSha256Bytes;
  if (file.size() != kHexBytes + suffix.size() || file.substr(kHexBytes) != suffix ||
      file.find_first_not_of("0123456789abcdef") != kHexBytes) {
    return std::nullopt;
  }
  return absl::HexStringToBytes(file.substr(0, kHexBytes));
}

timespec Now() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return now;
}

}  // namespace

ParticleFiles::ParticleFiles(FileDescriptor directory, FileDescriptor lock, std::string path,
                             const ServerLimits& limits)
    : directory_(std::move(directory)),
      lock_(std::move(lock)),
      path_(std::move(path)),
      limits_(limits) {}

ParticleFiles::~ParticleFiles() = default;

absl::StatusOr<std::unique_ptr<ParticleFiles>> ParticleFiles::Open(const std::string& path,
                                                                   const ServerLimits& limits) {
  const auto error = [&path](const std::string& what) {
    return absl::UnavailableError(fmt::format(
        "{}: {}: {}, allowed: a directory that the server may write, or whose parent it may", path,
        what, std::strerror(errno)));
  };
  const auto open_directory = [&path] {
    return FileDescriptor(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  };
  FileDescriptor directory = open_directory();
  if (!directory.ok() && errno == ENOENT) {
    if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) {
      return error("cannot be made");
    }
    directory = open_directory();
  }
  if (!directory.ok()) {
    return error("cannot be opened");
  }
  FileDescriptor lock(
      openat(directory.get(), kLockName, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!lock.ok()) {
    return error(fmt::format("{} in it cannot be opened", kLockName));
  }
  // Goes with the process, however that ends.
  if (flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    return errno == EWOULDBLOCK
               ? absl::UnavailableError(fmt::format(
                     "{}: another server uses it, allowed: a directory for each server", path))
               : error(fmt::format("{} in it cannot be locked", kLockName));
  }
  // The constructor is private.
  std::unique_ptr<ParticleFiles> files(
      new ParticleFiles(std::move(directory), std::move(lock), path, limits));
  if (absl::Status status = files->Scan(); !status.ok()) {
    return Prefixed(path + ": ", status);
  }
  return files;
}

absl::Status ParticleFiles::Scan() {
  struct Found {
    std::string sha256;
    uint64_t bytes;
    timespec used;
  };
  std::vector<Found> sets;
  int others = 0;
  // Reads through a descriptor of its own, which closedir closes.
  DIR* const stream = fdopendir(openat(directory_.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (stream == nullptr) {
    return SystemError(errno, "cannot be listed");
  }
  while (const dirent* entry = readdir(stream)) {
    const std::string file = static_cast<const char*>(entry->d_name);
    struct stat info {};
    if (file == "." || file == ".." || file == kLockName) {
      continue;
    }
    if (NameOfSet(file, kTemporarySuffix).has_value()) {
      unlinkat(directory_.get(), file.c_str(), 0);
      continue;
    }
    auto sha256 = NameOfSet(file, kSuffix);
    if (!sha256.has_value() ||
        fstatat(directory_.get(), file.c_str(), &info, AT_SYMLINK_NOFOLLOW) != 0 ||
        !S_ISREG(info.st_mode)) {
      ++others;
      continue;
    }
    sets.push_back(
        {*std::move(sha256), BlockBytes(static_cast<uint64_t>(info.st_size)), info.st_mtim});
  }
  closedir(stream);
  std::sort(sets.begin(), sets.end(), [](const Found& a, const Found& b) {
    return std::tie(a.used.tv_sec, a.used.tv_nsec, a.sha256) >
           std::tie(b.used.tv_sec, b.used.tv_nsec, b.sha256);
  });
  for (Found& set : sets) {
    by_use_.push_back({set.sha256, set.bytes});
    by_name_[set.sha256] = std::prev(by_use_.end());
    bytes_ += set.bytes;
  }
  MakeRoom(0);
  if (others > 0) {
    Log(LogLevel::kWarn, "cache_dir_others",
        {{"path", path_}, {"files", others}, {"message", "left alone"}});
  }
  Log(LogLevel::kInfo, "cache_dir", {{"path", path_}, {"sets", by_use_.size()}, {"bytes", bytes_}});
  return absl::OkStatus();
}

bool ParticleFiles::Use(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  const auto found = by_name_.find(sha256);
  if (found == by_name_.end()) {
    return false;
  }
  by_use_.splice(by_use_.begin(), by_use_, found->second);
  if (!std::exchange(found->second->touched, true)) {
    writer_.Post([this, sha256] { SetTime(sha256); });
  }
  return true;
}

uint64_t ParticleFiles::LeastMemoryBytes(const std::string& sha256) const {
  const std::lock_guard lock(mutex_);
  const auto found = by_name_.find(sha256);
  if (found == by_name_.end()) {
    return 0;
  }
  const uint64_t file = found->second->bytes;
  return file - std::min(file, 2 * kBlock);  // what stands before the values is in one more
}

void ParticleFiles::SetTime(const std::string& sha256) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = by_name_.find(sha256);
    if (found == by_name_.end()) {
      return;
    }
    found->second->touched = false;
  }
  // The clock's own time: what the kernel would put there moves in steps of milliseconds.
  const timespec times[] = {Now(), Now()};
  utimensat(directory_.get(), FileName(sha256).c_str(), times, AT_SYMLINK_NOFOLLOW);
}

void ParticleFiles::Write(const std::string& sha256, std::shared_ptr<const ParticleSet> set) {
  if (set->size() == 0 || Use(sha256)) {
    return;
  }
  const uint64_t bytes = ParticleFileBytes(*set);
  const char* refusal = nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.count(sha256) != 0 || by_name_.count(sha256) != 0) {
      return;
    }
    if (BlockBytes(bytes) > limits_.max_cache_dir_bytes) {
      refusal = "it is larger than --max-cache-dir-bytes";
    } else if (!waiting_.empty() && (waiting_bytes_ + bytes > limits_.max_cache_bytes / 4 ||
                                     waiting_.size() >= kMaxWaiting)) {
      refusal = "too much waits to be written";
    } else {
      waiting_.insert(sha256);
      waiting_bytes_ += bytes;
    }
  }
  if (refusal != nullptr) {
    LogNotWritten(sha256, refusal);
    return;
  }
  writer_.Post([this, sha256, set = std::move(set)] { WriteNow(sha256, set); });
}

void ParticleFiles::WriteNow(const std::string& sha256,
                             const std::shared_ptr<const ParticleSet>& set) {
  const uint64_t bytes = ParticleFileBytes(*set);
  MakeRoom(BlockBytes(bytes));
  absl::Status status = WriteFile(sha256, *set);
  if (absl::IsResourceExhausted(status)) {
    // The disk is smaller than the bound, or somebody else fills it.
    const uint64_t here = this->bytes();
    RemoveDownTo(here - std::min(here, BlockBytes(bytes)));
    status = WriteFile(sha256, *set);
  }
  if (!status.ok()) {
    LogNotWritten(sha256, MessageOf(status));
  }
  const std::lock_guard lock(mutex_);
  waiting_.erase(sha256);
  waiting_bytes_ -= bytes;
  if (status.ok()) {
    by_use_.push_front({sha256, BlockBytes(bytes)});
    by_name_[sha256] = by_use_.begin();
    bytes_ += BlockBytes(bytes);
  }
}

absl::Status ParticleFiles::WriteFile(const std::string& sha256, const ParticleSet& set) {
  const std::string name = FileName(sha256);
  const std::string temporary = ToHex(sha256) + kTemporarySuffix;
  absl::Status status;
  {
    const FileDescriptor file(openat(directory_.get(), temporary.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!file.ok()) {
      return SystemError(errno, "open");
    }
    status = WriteParticleFile(set, file.get());
    const timespec times[] = {Now(), Now()};
    if (status.ok() && (futimens(file.get(), times) != 0 || fsync(file.get()) != 0)) {
      status = SystemError(errno, "fsync");
    }
  }
  if (status.ok() &&
      renameat(directory_.get(), temporary.c_str(), directory_.get(), name.c_str()) != 0) {
    status = SystemError(errno, "rename");
  }
  if (!status.ok()) {
    unlinkat(directory_.get(), temporary.c_str(), 0);
    return status;
  }
  // Without it the name may be gone after a crash of the machine, which is no harm.
  fsync(directory_.get());
  return absl::OkStatus();
}

void ParticleFiles::Read(const std::string& sha256, std::stop_token stop, Done done) {
  {
    const std::lock_guard lock(mutex_);
    std::vector<Reader>& readers = readers_[sha256];
    readers.push_back({std::move(stop), std::move(done)});
    if (readers.size() > 1) {
      return;  // what is read for the first serves all
    }
  }
  reader_.Post([this, sha256] { ReadNow(sha256); });
}

void ParticleFiles::ReadNow(const std::string& sha256) {
  std::vector<Reader> readers;
  const auto take_readers = [&] {
    readers = std::move(readers_[sha256]);
    readers_.erase(sha256);
  };
  bool wanted = false;
  {
    const std::lock_guard lock(mutex_);
    const std::vector<Reader>& waiting = readers_[sha256];
    wanted = std::any_of(waiting.begin(), waiting.end(),
                         [](const Reader& reader) { return !reader.stop.stop_requested(); });
    if (!wanted) {
      take_readers();
    }
  }
  absl::StatusOr<std::shared_ptr<const ParticleSet>> set = nullptr;
  if (wanted) {
    set = ReadFile(sha256);
    const std::lock_guard lock(mutex_);
    take_readers();
  }
  for (const Reader& reader : readers) {
    reader.done(set);
  }
}

absl::StatusOr<std::shared_ptr<const ParticleSet>> ParticleFiles::ReadFile(
    const std::string& sha256) {
  const FileDescriptor file(openat(directory_.get(), FileName(sha256).c_str(),
                                   O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  absl::Status status;
  if (!file.ok()) {
    const int error = errno;
    status = SystemError(error, "open");
    if (error == EMFILE || error == ENFILE || error == ENOMEM) {
      // That says nothing of the file, which may well be read the next time.
      Log(LogLevel::kWarn, "cache_dir_not_read",
          {{"set", ToHex(sha256)}, {"message", MessageOf(status)}});
      return WithRetryHint(WithReason(WithCode(absl::StatusCode::kUnavailable, status),
                                      v1::ERROR_REASON_CACHE_NOT_READ));
    }
  } else {
    auto set = ReadParticleFile(file.get(), sha256, limits_);
    if (set.ok()) {
      return *std::move(set);
    }
    status = set.status();
  }
  const bool was_here = Forget(sha256);
  if (was_here && absl::IsDataLoss(status)) {
    writer_.Post([this, sha256] {
      const std::lock_guard lock(mutex_);
      // Unless it has been written again in between.
      if (by_name_.find(sha256) == by_name_.end()) {
        unlinkat(directory_.get(), FileName(sha256).c_str(), 0);
      }
    });
  }
  if (was_here) {
    Log(LogLevel::kWarn, "cache_dir_set_missing",
        {{"set", ToHex(sha256)},
         {"file_removed", absl::IsDataLoss(status)},
         {"message", MessageOf(status)}});
  }
  return nullptr;
}

// Whether it was here.
bool ParticleFiles::Forget(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  const auto found = by_name_.find(sha256);
  if (found == by_name_.end()) {
    return false;
  }
  bytes_ -= found->second->bytes;
  by_use_.erase(found->second);
  by_name_.erase(found);
  return true;
}

void ParticleFiles::MakeRoom(uint64_t bytes) {
  RemoveDownTo(limits_.max_cache_dir_bytes - std::min(limits_.max_cache_dir_bytes, bytes));
}

void ParticleFiles::RemoveDownTo(uint64_t bytes) {
  std::list<File> removed;
  {
    const std::lock_guard lock(mutex_);
    while (!by_use_.empty() && (bytes_ > bytes || by_use_.size() >= kMaxFiles)) {
      bytes_ -= by_use_.back().bytes;
      by_name_.erase(by_use_.back().sha256);
      removed.splice(removed.end(), by_use_, std::prev(by_use_.end()));
    }
  }
  for (const File& file : removed) {
    unlinkat(directory_.get(), FileName(file.sha256).c_str(), 0);
  }
}

bool ParticleFiles::idle() const {
  const std::lock_guard lock(mutex_);
  return waiting_.empty() && readers_.empty();
}

uint64_t ParticleFiles::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

size_t ParticleFiles::sets() const {
  const std::lock_guard lock(mutex_);
  return by_use_.size();
}

}  // namespace halflight
