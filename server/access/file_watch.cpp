#include "server/access/file_watch.h"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <utility>

#include <sys/stat.h>

#include <fmt/format.h>

#include "server/log/log.h"
#include "server/status_text.h"

namespace halflight {
namespace {

constexpr std::chrono::seconds kInterval{1};

}  // namespace

FileWatch::FileWatch(std::vector<std::string> paths) : paths_(std::move(paths)), seen_(State()) {}

void FileWatch::Start(std::function<absl::Status()> reload) {
  thread_ = std::jthread(
      [this, reload = std::move(reload)](const std::stop_token& stop) { Run(stop, reload); });
}

std::string FileWatch::State() const {
  std::string state;
  for (const std::string& path : paths_) {
    struct stat info {};
    if (stat(path.c_str(), &info) != 0) {
      state += "none;";
      continue;
    }
    state += fmt::format("{} {} {} {}.{} {}.{};", info.st_dev, info.st_ino, info.st_size,
                         info.st_mtim.tv_sec, info.st_mtim.tv_nsec, info.st_ctim.tv_sec,
                         info.st_ctim.tv_nsec);
  }
  return state;
}

void FileWatch::Run(const std::stop_token& stop, const std::function<absl::Status()>& reload) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  const std::string files = fmt::format("{}", fmt::join(paths_, " "));
  std::string last_complaint;
  bool failed = false;
  while (!wake.wait_for(lock, stop, kInterval, [&] { return stop.stop_requested(); })) {
    std::string state = State();
    const bool changed = state != seen_;
    if (!changed && !failed) {
      continue;
    }
    seen_ = std::move(state);
    const absl::Status status = reload();
    failed = !status.ok();
    if (!failed) {
      Log(LogLevel::kInfo, "reloaded", {{"files", files}});
      last_complaint.clear();
    } else if (const std::string message = MessageOf(status);
               changed || message != last_complaint) {
      Log(LogLevel::kWarn, "not_reloaded", {{"files", files}, {"message", message}});
      last_complaint = message;
    }
  }
}

}  // namespace halflight
