// Programs from embedded SPIR-V, specialised by constants.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/gl/object.h"

namespace halflight::gl {

struct Stage {
  GLenum type;  // GL_VERTEX_SHADER, ...
  std::span<const uint32_t> spirv;
};

// A program before specialisation: its stages, and which constants each of them declares.
struct ProgramSource {
  const char* name;
  std::vector<Stage> stages;
};

// Values of specialisation constants by number; those left out keep the shader's default.
using Constants = std::map<uint32_t, uint32_t>;

// Specialises and links. Internal with the driver's log on failure.
absl::StatusOr<Program> BuildProgram(const ProgramSource& source, const Constants& constants);

// Builds each program once for each set of constants, and keeps it.
class ProgramCache {
 public:
  // The name of the program, valid as long as the cache.
  absl::StatusOr<GLuint> Get(const ProgramSource& source, const Constants& constants);

  [[nodiscard]] size_t size() const { return programs_.size(); }

 private:
  std::map<std::pair<const ProgramSource*, Constants>, Program> programs_;
};

}  // namespace halflight::gl
