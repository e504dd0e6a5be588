// Reads files again when they have changed.
#pragma once

#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"

namespace halflight {

class FileWatch {
 public:
  // Notes what the files are now, so that no change after this is missed.
  explicit FileWatch(std::vector<std::string> paths);

  // From now on calls `reload` within a second after any of the files has changed, on a thread of
  // its own, and again every second until it returns OK. Logs that it did, or why not. Once.
  void Start(std::function<absl::Status()> reload);

 private:
  // Of each file which it is, its size and its times; replaced, moved and rewritten all change it.
  [[nodiscard]] std::string State() const;
  void Run(const std::stop_token& stop, const std::function<absl::Status()>& reload);

  const std::vector<std::string> paths_;
  std::string seen_;
  std::jthread thread_;
};

}  // namespace halflight
