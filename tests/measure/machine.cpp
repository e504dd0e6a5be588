#include "tests/measure/machine.h"

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

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::string text(11, '\0');
  text.resize(std::strftime(text.data(), text.size(), "%Y-%m-%d", &utc));
  return text;
}

}  // namespace halflight::measure
