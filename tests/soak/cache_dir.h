// What a bad disk does to a cache directory, for sabotage.
#pragma once

#include <filesystem>
#include <string>

namespace halflight::soak {

// Half of a set's file is not what was written, as after a write that the disk has lost.
inline void DamageAFile(const std::string& cache) {
  for (const auto& entry : std::filesystem::directory_iterator(cache)) {
    if (entry.path().extension() == ".particles") {
      std::filesystem::resize_file(entry.path(), std::filesystem::file_size(entry.path()) / 2);
      return;
    }
  }
}

}  // namespace halflight::soak
