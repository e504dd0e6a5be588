#include "tests/report/pareto.h"

#include <algorithm>

namespace halflight::report {

std::vector<bool> ParetoFront(std::span<const CostAndError> points) {
  std::vector<bool> front;
  for (const CostAndError& point : points) {
    front.push_back(std::none_of(points.begin(), points.end(), [&](const CostAndError& other) {
      return other.cost <= point.cost && other.error <= point.error &&
             (other.cost < point.cost || other.error < point.error);
    }));
  }
  return front;
}

}  // namespace halflight::report
