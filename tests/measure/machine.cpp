#include "tests/measure/machine.h"

#include <sys/resource.h>
#include <unistd.h>

#include <ctime>
#include <fstream>

namespace halflight::measure {

std::string CpuModel() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  return "unknown CPU";
}

CpuSeconds CpuSecondsSoFar() {
  CpuSeconds seconds;
  // user nice system idle iowait irq softirq steal, in ticks
  std::ifstream file("/proc/stat");
  std::string name;
  file >> name;
  const auto ticks = static_cast<double>(sysconf(_SC_CLK_TCK));
  double value = 0.0;
  for (int field = 0; field < 8 && file >> value; ++field) {
    if (field != 3 && field != 4) seconds.all += value / ticks;
  }
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& time : {usage.ru_utime, usage.ru_stime}) {
      seconds.own += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    }
  }
  return seconds;
}

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::string text(11, '\0');
  text.resize(std::strftime(text.data(), text.size(), "%Y-%m-%d", &utc));
  return text;
}

}  // namespace halflight::measure
