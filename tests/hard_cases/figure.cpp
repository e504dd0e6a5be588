#include "tests/hard_cases/figure.h"

#include <cctype>
#include <cstdio>

#include <gtest/gtest.h>

namespace halflight::test {

void PrintFigure(const std::string& subject, const std::string& property, double value,
                 double bound) {
  std::printf("| %s | %s | %.2g | %.2g |\n", subject.c_str(), property.c_str(), value, bound);
  std::fflush(stdout);
  // Names in the XML are of letters, digits and underscores.
  std::string key = subject + "_" + property;
  for (char& c : key) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  testing::Test::RecordProperty(key, std::to_string(value));
}

void ExpectAtMost(const std::string& subject, const std::string& property, double value,
                  double bound) {
  PrintFigure(subject, property, value, bound);
  EXPECT_LE(value, bound) << subject << ": " << property;
}

}  // namespace halflight::test
