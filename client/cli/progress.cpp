#include "client/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace halflight::client {

std::string ProgressLine(uint64_t done, uint64_t total, double elapsed_s) {
  constexpr size_t kWidth = 30;
  const size_t filled = total == 0 ? kWidth : kWidth * done / total;
  std::string line = fmt::format("[{}{}] {}/{} frames", std::string(filled, '#'),
                                 std::string(kWidth - filled, '-'), done, total);
  if (done > 0 && elapsed_s > 0) {
    const double fps = static_cast<double>(done) / elapsed_s;
    line +=
        fmt::format("  {:.2f} fps  {:.1f} s left", fps, static_cast<double>(total - done) / fps);
  }
  return line;
}

ProgressBar::ProgressBar(uint64_t total, bool wanted)
    : total_(total),
      shown_(wanted && isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()) {
  Draw(0);
}

ProgressBar::~ProgressBar() { Clear(); }

void ProgressBar::Draw(uint64_t done) {
  if (shown_) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    fmt::print(stderr, "\r\033[K{}", ProgressLine(done, total_, elapsed.count()));
    std::fflush(stderr);
  }
}

void ProgressBar::Clear() {
  if (shown_) {
    fmt::print(stderr, "\r\033[K");
    std::fflush(stderr);
  }
}

}  // namespace halflight::client
