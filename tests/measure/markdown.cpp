#include "tests/measure/markdown.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

namespace halflight::measure {

std::string Number(double value) {
  if (value < 5e-5) return "0";
  const double percent = 100.0 * value;
  if (percent < 0.995) return absl::StrFormat("%.2f", percent);
  return percent < 9.95 ? absl::StrFormat("%.1f", percent) : absl::StrFormat("%.0f", percent);
}

std::string Percent(double value) { return absl::StrCat(Number(value), " %"); }

std::string Limit(double value) { return absl::StrFormat("%g %%", 100.0 * value); }

std::string Times(double ratio) {
  if (ratio < 0.995) return absl::StrFormat("%.2f\u00d7", ratio);
  return ratio < 9.95 ? absl::StrFormat("%.1f\u00d7", ratio) : absl::StrFormat("%.0f\u00d7", ratio);
}

std::string Row(const std::vector<std::string>& cells) {
  return absl::StrCat("| ", absl::StrJoin(cells, " | "), " |\n");
}

std::string Rule(size_t columns) {
  return absl::StrCat("|", absl::StrJoin(std::vector<std::string>(columns, "---"), "|"), "|\n");
}

}  // namespace halflight::measure
