// Which of several ways are worth their price.
#pragma once

#include <span>
#include <vector>

namespace halflight::report {

struct CostAndError {
  double cost;
  double error;
};

// True for each point that no other one beats: none costs no more and errs no more, and is better
// in one of the two. Of equal points all are on the front, or none.
std::vector<bool> ParetoFront(std::span<const CostAndError> points);

}  // namespace halflight::report
