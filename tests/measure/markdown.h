// Figures and tables as the page prints them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace halflight::measure {

// A part as percents with two digits, without and with the sign. What is rounding alone is 0.
std::string Number(double value);
std::string Percent(double value);
// Of a limit, which is a round number.
std::string Limit(double value);
// An error below which a frame differs from the model by rounding alone.
inline constexpr double kExact = 1e-6;

// "0.31x", "1.3x", "26x", with the sign of multiplication.
std::string Times(double ratio);

// A table's line, and the line of dashes under its head.
std::string Row(const std::vector<std::string>& cells);
std::string Rule(size_t columns);

}  // namespace halflight::measure
