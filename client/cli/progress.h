// The progress bar of a sequence, on a terminal. Prints nothing elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace halflight::client {

// "[#######-----] 7/12 frames  3.1 fps  1.6 s left".
std::string ProgressLine(uint64_t done, uint64_t total, double elapsed_s);

// Keeps one line of stderr up to date; used from one thread.
class ProgressBar {
 public:
  // Draws only where `wanted` and stderr is a terminal.
  ProgressBar(uint64_t total, bool wanted);
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  // Removes the line, so that what follows starts on a clean one.
  ~ProgressBar();

  void Draw(uint64_t done);
  // Before anything else is printed while the bar is shown.
  void Clear();

 private:
  uint64_t total_;
  bool shown_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace halflight::client
