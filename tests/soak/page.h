// docs/reliability.md: prose by hand, a block of figures for each scenario by the program.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "tests/soak/report.h"

namespace halflight::soak {

// A scenario as it was run.
struct Outcome {
  std::string scenario{};
  std::string what{};
  std::string sabotage{};
  std::vector<Row> rows{};
  std::string made{};  // when, of which revision, on what
};

// Puts the outcome between the lines "<!-- soak: NAME -->" and "<!-- end -->" of the page, at its
// end where there are no such lines. What other scenarios have reached stays, with their own dates.
absl::Status PutOnPage(const std::string& path, const Outcome& outcome);

// The page's text with that block; `block` ends with a line's end.
std::string WithBlock(const std::string& page, std::string_view scenario, const std::string& block);

}  // namespace halflight::soak
