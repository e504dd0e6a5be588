// Whether memory that was freed stays with the process, and goes when it is told to, by what the
// system counts: pages that had to be fetched, and pages held.
#include "renderer/kept_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sanitizers.h"

namespace halflight {
namespace {

constexpr size_t kFrameBytes = size_t{16} * 1280 * 720;

// A new buffer of a frame's size, all of it written, by a thread of its own, freed by this one.
void MakeFrameElsewhere() {
  std::vector<char> frame;
  std::thread([&frame] { frame.assign(kFrameBytes, 1); }).join();
}

int64_t PagesFetched() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

int64_t BytesHeld() {
  int64_t size = 0;
  int64_t resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

TEST(KeptMemory, ServesTheNextFrameUntilItIsGivenBack) {
#ifndef __GLIBC__
  GTEST_SKIP() << "another allocator";
#endif
  if (testing::kSanitized) GTEST_SKIP() << "another allocator";
  KeepFreedMemory();
  MakeFrameElsewhere();
  const int64_t fetched = PagesFetched();
  constexpr int kFrames = 10;
  for (int frame = 0; frame < kFrames; ++frame) MakeFrameElsewhere();
  // A thread takes a few pages for its stack.
  EXPECT_LT(PagesFetched() - fetched, kFrames * 50);

  const int64_t held = BytesHeld();
  GiveBackFreedMemory();
  EXPECT_LT(BytesHeld(), held - static_cast<int64_t>(kFrameBytes) / 2);
}

}  // namespace
}  // namespace halflight
