// Single values in Prometheus's terms, for what is read when somebody looks.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <prometheus/metric_family.h>

namespace halflight {

struct Sample {
  std::vector<prometheus::ClientMetric::Label> labels{};
  double value = 0.0;
};

inline prometheus::MetricFamily FamilyOf(prometheus::MetricType type, std::string name,
                                         std::string help, std::vector<Sample> samples) {
  prometheus::MetricFamily family{std::move(name), std::move(help), type, {}};
  for (Sample& sample : samples) {
    prometheus::ClientMetric& metric = family.metric.emplace_back();
    metric.label = std::move(sample.labels);
    (type == prometheus::MetricType::Counter ? metric.counter.value : metric.gauge.value) =
        sample.value;
  }
  return family;
}

inline prometheus::MetricFamily GaugeOf(std::string name, std::string help,
                                        std::vector<Sample> samples) {
  return FamilyOf(prometheus::MetricType::Gauge, std::move(name), std::move(help),
                  std::move(samples));
}

inline prometheus::MetricFamily CounterOf(std::string name, std::string help,
                                          std::vector<Sample> samples) {
  return FamilyOf(prometheus::MetricType::Counter, std::move(name), std::move(help),
                  std::move(samples));
}

}  // namespace halflight
