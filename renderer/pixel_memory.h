// Memory for the pixels of an image, which may be gigabytes: in huge pages where the system has
// them. Taken in small ones, a gigabyte costs as much time as a frame that fills it. Any thread.
#pragma once

#include <cstddef>
#include <stop_token>
#include <vector>

namespace halflight {

// As values.reserve(count).
void ReservePixels(size_t count, std::vector<float>& values);

// `count` zeros; fewer once `stop` was requested.
std::vector<float> Zeros(size_t count, const std::stop_token& stop = {});

}  // namespace halflight
