#include "server/metrics/process_state.h"

#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <sstream>
#include <string>
#include <system_error>

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include "absl/strings/numbers.h"
#include "server/metrics/families.h"

namespace halflight {
namespace {

// The fields of /proc/self/stat from the third on: the second, the program's name, may hold
// anything.
std::vector<std::string> StatFields() {
  std::ostringstream text;
  text << std::ifstream("/proc/self/stat").rdbuf();
  std::string stat = text.str();
  const size_t name_end = stat.rfind(')');
  std::istringstream rest(name_end == std::string::npos ? "" : stat.substr(name_end + 1));
  return {std::istream_iterator<std::string>(rest), {}};
}

double Now(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

// The same each time, however the clocks drift. Not from /proc/stat, which systemd may hide.
double StartTime(double seconds_after_boot) {
  static const double start = Now(CLOCK_REALTIME) - Now(CLOCK_BOOTTIME) + seconds_after_boot;
  return start;
}

// Of glibc's allocator, which looks at all that is free, and allocates nothing meanwhile: not for
// whoever asks again and again.
double HeapBytes() {
  constexpr double kOld = 1.0;  // seconds
  static std::mutex mutex;
  static double looked = -kOld;
  static double bytes = 0.0;
  const std::lock_guard lock(mutex);
  if (const double now = Now(CLOCK_MONOTONIC); now - looked >= kOld) {
    const struct mallinfo2 heap = mallinfo2();
    bytes = static_cast<double>(heap.uordblks + heap.hblkhd);
    looked = now;
  }
  return bytes;
}

}  // namespace

std::vector<prometheus::MetricFamily> ProcessState() {
  std::vector<prometheus::MetricFamily> state;
  // By proc(5), counted from 1: 14 and 15 processor time, 20 threads, 22 start, 23 and 24 memory.
  if (const std::vector<std::string> fields = StatFields(); fields.size() > 22) {
    const auto number = [&fields](size_t field) {
      double value = 0.0;
      return absl::SimpleAtod(fields[field - 3], &value) ? value : 0.0;
    };
    const auto ticks = static_cast<double>(sysconf(_SC_CLK_TCK));
    state.push_back(CounterOf("process_cpu_seconds_total", "Processor time, user and system",
                              {{.value = (number(14) + number(15)) / ticks}}));
    state.push_back(GaugeOf("process_threads", "Threads", {{.value = number(20)}}));
    state.push_back(GaugeOf("process_start_time_seconds", "Start, in seconds since 1970",
                            {{.value = StartTime(number(22) / ticks)}}));
    state.push_back(
        GaugeOf("process_virtual_memory_bytes", "Address space", {{.value = number(23)}}));
    state.push_back(GaugeOf("process_resident_memory_bytes", "Memory in RAM",
                            {{.value = number(24) * static_cast<double>(sysconf(_SC_PAGESIZE))}}));
  }
  state.push_back(
      GaugeOf("process_heap_bytes", "Memory allocated and not freed", {{.value = HeapBytes()}}));
  std::error_code error;
  if (const std::filesystem::directory_iterator open("/proc/self/fd", error); !error) {
    state.push_back(
        GaugeOf("process_open_fds", "Descriptors that are open",
                {{.value = static_cast<double>(std::distance(begin(open), end(open)))}}));
  }
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    state.push_back(GaugeOf("process_max_fds", "Descriptors that may be open",
                            {{.value = static_cast<double>(limit.rlim_cur)}}));
  }
  return state;
}

}  // namespace halflight
