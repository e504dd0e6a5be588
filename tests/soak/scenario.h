// A fault, or a load, and what the service promises under it. The table of them is in
// scenarios.cpp; each has a file of its own.
#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "tests/soak/report.h"

namespace halflight::soak {

struct Run {
  Report& report;
  // A few seconds, for the ordinary tests: counts are small, and times are told only.
  bool short_form = false;
  // Against a server without the protection that the scenario is about.
  bool sabotage = false;

  [[nodiscard]] int Of(int in_long_form, int in_short_form) const {
    return short_form ? in_short_form : in_long_form;
  }
};

struct Scenario {
  std::string_view name;
  std::string_view what;
  // What --sabotage takes away, and the properties that must be missed then: beginnings of their
  // names.
  std::string_view sabotage;
  std::vector<std::string_view> missed;
  void (*run)(Run& run) = nullptr;
};

std::span<const Scenario> Scenarios();

// The scenario cannot go on: it counts as missed, with this text.
struct Abandoned : std::runtime_error {
  using std::runtime_error::runtime_error;
};
void Require(bool holds, const std::string& what);
void Require(const absl::Status& status, const std::string& what);

void RunConnections(Run& run);
void RunCancellations(Run& run);
void RunUploadClientsKilled(Run& run);
void RunUploadServersKilled(Run& run);
void RunDescriptors(Run& run);
void RunDeviceFaults(Run& run);
void RunDiskFull(Run& run);
void RunMalformed(Run& run);
void RunOverload(Run& run);
void RunRestarts(Run& run);
void RunStopping(Run& run);
void RunMixedWork(Run& run);

}  // namespace halflight::soak
