// What a scenario has reached, row by row, and what it was to reach.
#pragma once

#include <string>
#include <vector>

namespace halflight::soak {

struct Row {
  std::string property{};
  std::string reached{};
  std::string bound{};  // "" where it is only told
  bool ok = true;
};

class Report {
 public:
  // `timed`: whether times are held to their bounds; otherwise they are only told, since they
  // belong to an idle machine.
  explicit Report(bool timed) : timed_(timed) {}

  void AtMost(const std::string& property, double reached, double bound, const std::string& unit);
  void AtLeast(const std::string& property, double reached, double bound, const std::string& unit);
  // What has to do with time or with a rate.
  void TimeAtMost(const std::string& property, double reached, double bound,
                  const std::string& unit);
  void RateAtLeast(const std::string& property, double reached, double bound,
                   const std::string& unit);
  // In MiB. Told alone where a sanitizer keeps for a while what was freed.
  void MemoryAtMost(const std::string& property, double reached, double bound);
  // None of them: what is counted must not be.
  void None(const std::string& property, size_t count);
  void Holds(const std::string& property, bool holds, const std::string& reached = "");
  void Tell(const std::string& property, const std::string& reached);
  void Tell(const std::string& property, double reached, const std::string& unit);

  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] bool ok() const;

 private:
  void Add(Row row);

  const bool timed_;
  std::vector<Row> rows_;
};

// "| scenario | property | reached | bound | ok |"
std::string LineOf(const std::string& scenario, const Row& row);

// "12", "1.5", "0.031": three digits, without an exponent.
std::string Digits(double value);

}  // namespace halflight::soak
