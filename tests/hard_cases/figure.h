// Figures that tests reach, as rows of the table in docs/hard-cases.md (`./dev hardcases`).
#pragma once

#include <string>

namespace halflight::test {

// Prints the row "| subject | property | value | bound |", and puts the value into the test's XML.
void PrintFigure(const std::string& subject, const std::string& property, double value,
                 double bound);

// The same, and fails the test where the value is above the bound, or no number.
void ExpectAtMost(const std::string& subject, const std::string& property, double value,
                  double bound);

}  // namespace halflight::test
