#include "tests/soak/report.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <utility>

#include <fmt/format.h>

#include "tests/sanitizers.h"

namespace halflight::soak {

std::string Digits(double value) {
  if (std::abs(value) >= 100.0 || value == std::round(value)) {
    return fmt::format("{:.0f}", value);
  }
  return fmt::format("{:.{}f}", value,
                     std::abs(value) >= 10.0  ? 1
                     : std::abs(value) >= 1.0 ? 2
                                              : 3);
}

std::string LineOf(const std::string& scenario, const Row& row) {
  return fmt::format("| {} | {} | {} | {} | {} |", scenario, row.property, row.reached,
                     row.bound.empty() ? "told" : row.bound,
                     row.ok ? (row.bound.empty() ? "" : "yes") : "**no**");
}

void Report::Add(Row row) {
  std::cerr << LineOf("", row) << std::endl;  // as it comes: a long run is watched
  rows_.push_back(std::move(row));
}

void Report::AtMost(const std::string& property, double reached, double bound,
                    const std::string& unit) {
  Add({property, Digits(reached) + unit, "at most " + Digits(bound) + unit, reached <= bound});
}

void Report::AtLeast(const std::string& property, double reached, double bound,
                     const std::string& unit) {
  Add({property, Digits(reached) + unit, "at least " + Digits(bound) + unit, reached >= bound});
}

void Report::TimeAtMost(const std::string& property, double reached, double bound,
                        const std::string& unit) {
  if (timed_) {
    AtMost(property, reached, bound, unit);
  } else {
    Tell(property, reached, unit);
  }
}

void Report::MemoryAtMost(const std::string& property, double reached, double bound) {
  if (testing::kSanitized) {
    Tell(property, reached, " MiB");
  } else {
    AtMost(property, reached, bound, " MiB");
  }
}

void Report::RateAtLeast(const std::string& property, double reached, double bound,
                         const std::string& unit) {
  if (timed_) {
    AtLeast(property, reached, bound, unit);
  } else {
    Tell(property, reached, unit);
  }
}

void Report::None(const std::string& property, size_t count) {
  Add({property, std::to_string(count), "none", count == 0});
}

void Report::Holds(const std::string& property, bool holds, const std::string& reached) {
  Add({property, reached.empty() ? (holds ? "yes" : "no") : reached, "yes", holds});
}

void Report::Tell(const std::string& property, const std::string& reached) {
  Add({property, reached, "", true});
}

void Report::Tell(const std::string& property, double reached, const std::string& unit) {
  Tell(property, Digits(reached) + unit);
}

bool Report::ok() const {
  return std::all_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.ok; });
}

}  // namespace halflight::soak
