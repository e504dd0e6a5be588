// Whether a folder holds a whole report that agrees with itself. For the tests.
// Leaves out whether its figures are true.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace halflight::report {

// One line of measurements.csv, by the names of its head.
using CsvRow = std::map<std::string, std::string>;

// Empty where a line has not as many values as the head.
std::vector<CsvRow> ReadCsv(const std::string& text);

// What is wrong with it, in words; nothing where all is well:
// - the page names every scene of the table, and all that it links to is there;
// - the table parses, has a baseline of ratio 1, and marks as front exactly what nothing beats;
// - plots are well-formed XML without values that are not numbers;
// - pictures decode, and those of smoke are of more than one colour.
std::vector<std::string> FaultsOf(const std::string& folder);

}  // namespace halflight::report
