#include "tests/soak/page.h"

#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "absl/strings/str_cat.h"

namespace halflight::soak {

std::string WithBlock(const std::string& page, std::string_view scenario,
                      const std::string& block) {
  const std::string begin = fmt::format("<!-- soak: {} -->\n", scenario);
  const std::string end = "<!-- end -->\n";
  const size_t at = page.find(begin);
  const size_t until = page.find(end, at);
  if (at == std::string::npos || until == std::string::npos) {
    return absl::StrCat(page, "\n", begin, block, end);
  }
  return absl::StrCat(page.substr(0, at), begin, block, page.substr(until));
}

absl::Status PutOnPage(const std::string& path, const Outcome& outcome) {
  std::ostringstream before;
  before << std::ifstream(path).rdbuf();
  std::string block = fmt::format(
      "\n### {}\n\n{}. Shown to fail with {}. Made {}.\n\n"
      "| scenario | property | reached | bound | ok |\n|---|---|---|---|---|\n",
      outcome.scenario, outcome.what, outcome.sabotage, outcome.made);
  for (const Row& row : outcome.rows) {
    block += LineOf(outcome.scenario, row) + "\n";
  }
  block += "\n";
  const std::string after = WithBlock(before.str(), outcome.scenario, block);
  std::ofstream file(path);
  file << after;
  file.close();
  return file ? absl::OkStatus() : absl::PermissionDeniedError("cannot write " + path);
}

}  // namespace halflight::soak
