// What the kernel says of this process, under the names that Prometheus's client libraries use.
#pragma once

#include <vector>

#include <prometheus/metric_family.h>

namespace halflight {

// Memory, processor time, threads, descriptors and start. What cannot be read is left out.
std::vector<prometheus::MetricFamily> ProcessState();

}  // namespace halflight
