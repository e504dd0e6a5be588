// Reads binary little-endian PLY of seven float properties a vertex; see plume.h.
#include "tests/oracle/plume.h"

#include <array>
#include <bit>
#include <fstream>
#include <sstream>

namespace halflight::oracle {

std::shared_ptr<ParticleSet> LoadPlume(const std::string& path) {
  static_assert(std::endian::native == std::endian::little, "the files are little-endian");
  std::ifstream file(path, std::ios::binary);
  size_t count = 0;
  std::string format;
  std::string properties;
  for (std::string line; std::getline(file, line) && line != "end_header";) {
    std::istringstream words(line);
    std::string first;
    std::string second;
    std::string third;
    words >> first >> second >> third;
    if (first == "format") format = second;
    if (first == "element" && second == "vertex") count = std::stoul(third);
    if (first == "property") properties.append(second).append(" ").append(third).append(";");
  }
  if (format != "binary_little_endian" ||
      properties != "float x;float y;float z;float vx;float vy;float vz;float age;") {
    return nullptr;
  }
  auto set = std::make_shared<ParticleSet>();
  std::array<float, 7> vertex{};
  for (size_t i = 0; i < count; ++i) {
    if (!file.read(reinterpret_cast<char*>(vertex.data()), sizeof(vertex))) return nullptr;
    set->positions.emplace_back(vertex[0], vertex[1], vertex[2]);
    set->velocities.emplace_back(vertex[3], vertex[4], vertex[5]);
  }
  return set;
}

}  // namespace halflight::oracle
