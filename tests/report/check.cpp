#include "tests/report/check.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "tests/encode/decoded.h"

namespace halflight::report {
namespace {

namespace fs = std::filesystem;

using Faults = std::vector<std::string>;

std::string Contents(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

double NumberIn(const CsvRow& row, const std::string& column, Faults& faults) {
  double number = 0.0;
  const auto value = row.find(column);
  if (value == row.end() || !absl::SimpleAtod(value->second, &number) || !(number >= -1e9)) {
    faults.push_back(absl::StrCat("table: no number in ", column));
  }
  return number;
}

// Of the rows of one scene.
void CheckFront(const std::vector<const CsvRow*>& rows, Faults& faults) {
  for (const CsvRow* row : rows) {
    const double time = NumberIn(*row, "time_ratio", faults);
    const double error = NumberIn(*row, "rmse", faults);
    bool beaten = false;
    for (const CsvRow* other : rows) {
      const double other_time = NumberIn(*other, "time_ratio", faults);
      const double other_error = NumberIn(*other, "rmse", faults);
      beaten |=
          other_time <= time && other_error <= error && (other_time < time || other_error < error);
    }
    if (beaten == (NumberIn(*row, "on_front", faults) != 0.0)) {
      faults.push_back(absl::StrCat("front: ", row->at("scene"), ", ", row->at("setting"),
                                    beaten ? " is beaten" : " is beaten by none"));
    }
  }
}

void CheckTable(const std::string& text, const std::string& page, Faults& faults) {
  const std::vector<CsvRow> rows = ReadCsv(text);
  if (rows.empty()) faults.emplace_back("table: empty, or lines of different lengths");
  std::map<std::string, std::vector<const CsvRow*>> scenes;
  for (const CsvRow& row : rows) {
    for (const char* column : {"milliseconds", "rmse_low", "rmse_high", "bias", "p999", "max"}) {
      NumberIn(row, column, faults);
    }
    scenes[row.at("scene")].push_back(&row);
  }
  bool has_baseline = false;
  for (const auto& [scene, of_scene] : scenes) {
    if (!absl::StrContains(page, scene)) faults.push_back("page: does not name " + scene);
    CheckFront(of_scene, faults);
    for (const CsvRow* row : of_scene) has_baseline |= row->at("time_ratio") == "1.000000";
  }
  if (!has_baseline) faults.emplace_back("table: no baseline");
}

void CheckLinks(const std::string& page, const fs::path& folder, Faults& faults) {
  const std::regex link(R"(\]\(([^)]+)\))");
  for (std::sregex_iterator at(page.begin(), page.end(), link), end; at != end; ++at) {
    const std::string target = (*at)[1];
    if (!absl::StartsWith(target, "../") && !fs::exists(folder / target)) {
      faults.push_back("page: links to " + target + ", which is not there");
    }
  }
}

// Every element is closed, in order.
void CheckPlot(const std::string& name, const std::string& text, Faults& faults) {
  std::vector<std::string> open;
  const std::regex tag(R"(<(/?)([a-z]+)[^<>]*?(/?)>)");
  size_t elements = 0;
  for (std::sregex_iterator at(text.begin(), text.end(), tag), end; at != end; ++at) {
    ++elements;
    const std::string element = (*at)[2];
    if ((*at)[1].length() == 0) {
      if ((*at)[3].length() == 0) open.push_back(element);
    } else if (open.empty() || open.back() != element) {
      faults.push_back(name + ": </" + element + "> closes what is not open");
    } else {
      open.pop_back();
    }
  }
  const auto brackets = std::count(text.begin(), text.end(), '<');
  if (elements == 0 || !open.empty() || static_cast<size_t>(brackets) != elements) {
    faults.push_back(name + ": not well-formed");
  }
  if (absl::StrContains(text, "nan") || absl::StrContains(text, "inf ")) {
    faults.push_back(name + ": values that are not numbers");
  }
}

void CheckPicture(const std::string& name, const std::string& bytes, Faults& faults) {
  const std::vector<DecodedPart> parts = Decode(bytes, "png");
  if (parts.empty() || parts[0].values.empty()) {
    faults.push_back(name + ": does not decode");
    return;
  }
  const auto& values = parts[0].values;
  const bool one_value =
      std::all_of(values.begin(), values.end(), [&](float value) { return value == values[0]; });
  if (one_value && !absl::StrContains(name, "error")) faults.push_back(name + ": blank");
}

}  // namespace

std::vector<CsvRow> ReadCsv(const std::string& text) {
  std::vector<std::string> lines = absl::StrSplit(text, '\n', absl::SkipEmpty());
  if (lines.empty()) return {};
  const std::vector<std::string> head = absl::StrSplit(lines[0], ',');
  std::vector<CsvRow> rows;
  for (size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string> values = absl::StrSplit(lines[i], ',');
    if (values.size() != head.size()) return {};
    CsvRow row;
    for (size_t k = 0; k < head.size(); ++k) row[head[k]] = values[k];
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<std::string> FaultsOf(const std::string& folder) {
  Faults faults;
  const std::string page = Contents(fs::path(folder) / "README.md");
  CheckTable(Contents(fs::path(folder) / "measurements.csv"), page, faults);
  CheckLinks(page, folder, faults);
  std::map<std::string, int> seen;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename();
    const std::string ending = entry.path().extension();
    ++seen[ending];
    if (ending == ".svg") CheckPlot(name, Contents(entry), faults);
    if (ending == ".png") CheckPicture(name, Contents(entry), faults);
  }
  for (const char* ending : {".md", ".csv", ".svg", ".png"}) {
    if (seen[ending] == 0) faults.push_back(absl::StrCat("no file ends in ", ending));
  }
  return faults;
}

}  // namespace halflight::report
