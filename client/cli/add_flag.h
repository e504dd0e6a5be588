// Declares one flag of a kind: its value is checked while the command line is read, and an error
// names the flag, the value received and the values allowed. Which flags there are is in flags.cpp.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/flag_values.h"
#include "client/readers/text.h"
#include "client/status_text.h"
#include "halflight/particle_payload.h"

namespace halflight::client {

// Unwraps a parsed value, or tells CLI11 what is wrong with the flag.
template <typename T>
T ValueOr(const std::string& flag, absl::StatusOr<T> value) {
  if (!value.ok()) {
    throw CLI::ValidationError(flag, MessageOf(value.status()));
  }
  return *std::move(value);
}

// A flag with one value that `parse` reads into `target`.
template <typename Target, typename T>
CLI::Option* Add(CLI::App& app, const std::string& flag, Target& target,
                 absl::StatusOr<T> (*parse)(std::string_view), const std::string& help,
                 const std::string& type) {
  return app
      .add_option_function<std::string>(
          flag,
          [&target, parse, flag](const std::string& text) { target = ValueOr(flag, parse(text)); },
          help)
      ->type_name(type);
}

// A repeatable flag, each time with one value.
template <typename T>
CLI::Option* AddEach(CLI::App& app, const std::string& flag, std::vector<T>& target,
                     absl::StatusOr<T> (*parse)(std::string_view), const std::string& help,
                     const std::string& type) {
  return app
      .add_option_function<std::vector<std::string>>(
          flag,
          [&target, parse, flag](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              target.push_back(ValueOr(flag, parse(text)));
            }
          },
          help)
      ->type_name(type)
      ->allow_extra_args(false);
}

// The numbers that a flag takes.
struct Range {
  double low;
  double high;
  const char* in_words;
  bool low_included = true;
  bool high_included = true;
};
inline constexpr Range kPositive{0, HUGE_VAL, "a number > 0", false, false};
// Of fields that are 32-bit floats in the request.
inline constexpr Range kNotNegative{0, kLargestFloat, "a number from 0 to 3e38"};
inline constexpr Range kRadius{kSmallestRadius, kLargestLength, "a number from 1e-15 to 1e17"};
// The largest below 1 that is so as a 32-bit float too, in decimal.
inline constexpr double kBelowOne = 0.9999999;

inline CLI::Option* AddNumber(CLI::App& app, const std::string& flag, std::optional<double>& target,
                              const Range& range, const std::string& help) {
  return app
      .add_option_function<std::string>(
          flag,
          [&target, range, flag](const std::string& text) {
            const auto value = ParseNumber(text);
            const bool fits =
                value && (*value > range.low || (range.low_included && *value == range.low)) &&
                (*value < range.high || (range.high_included && *value == range.high));
            if (!fits) {
              throw CLI::ValidationError(flag,
                                         fmt::format("is '{}'; allowed: {}", text, range.in_words));
            }
            target = value;
          },
          help)
      ->type_name("NUMBER");
}

inline CLI::Option* AddCount(CLI::App& app, const std::string& flag,
                             std::optional<uint32_t>& target, uint32_t low, uint32_t high,
                             const std::string& help) {
  return app
      .add_option_function<std::string>(
          flag,
          [&target, low, high, flag](const std::string& text) {
            const auto value = ParseCount(text);
            if (!value || *value < low || *value > high) {
              throw CLI::ValidationError(flag, fmt::format("is '{}'; allowed: a whole number from "
                                                           "{} to {}",
                                                           text, low, high));
            }
            target = static_cast<uint32_t>(*value);
          },
          help)
      ->type_name("COUNT");
}

template <typename T>
CLI::Option* AddChoice(CLI::App& app, const std::string& flag, std::optional<T>& target,
                       const std::vector<std::pair<std::string, T>>& choices,
                       const std::string& help) {
  std::string names;
  for (const auto& [name, value] : choices) {
    names += fmt::format("{}{}", names.empty() ? "" : "|", name);
  }
  return app
      .add_option_function<std::string>(
          flag,
          [&target, choices, flag, names](const std::string& text) {
            for (const auto& [name, value] : choices) {
              if (text == name) {
                target = value;
                return;
              }
            }
            throw CLI::ValidationError(flag, fmt::format("is '{}'; allowed: {}", text, names));
          },
          help)
      ->type_name(names);
}

}  // namespace halflight::client
