// What a bad disk does to a cache directory, for sabotage.
#pragma once

#include <filesystem>
#include <fstream>
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

// A file that was being written when the server ended, which the next one has not removed.
inline void LeaveHalfAFile(const std::string& cache) {
  std::ofstream(cache + "/" + std::string(64, 'a') + ".particles.writing") << "half of it";
}

}  // namespace halflight::soak
