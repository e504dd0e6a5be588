#include "renderer/gl/program.h"

#include <set>
#include <string>

#include "absl/strings/str_cat.h"

namespace halflight::gl {

namespace {

// Numbers of the specialisation constants in a module (SPIR-V 1.0, section 2.3 and OpDecorate with
// SpecId): a driver may refuse values for constants that a stage does not declare.
std::set<uint32_t> DeclaredConstants(std::span<const uint32_t> spirv) {
  constexpr uint32_t kHeaderWords = 5;
  constexpr uint32_t kOpDecorate = 71;
  constexpr uint32_t kSpecId = 1;
  std::set<uint32_t> declared;
  for (size_t at = kHeaderWords; at < spirv.size();) {
    const uint32_t words = spirv[at] >> 16U;
    const uint32_t opcode = spirv[at] & 0xFFFFU;
    if (words == 0) break;
    if (opcode == kOpDecorate && words == 4 && spirv[at + 2] == kSpecId) {
      declared.insert(spirv[at + 3]);
    }
    at += words;
  }
  return declared;
}

template <typename GetLog>
std::string Log(const GetLog& get_log) {
  std::string log(4096, '\0');
  GLsizei length = 0;
  get_log(static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(static_cast<size_t>(length));
  return log;
}

absl::StatusOr<Shader> BuildStage(const char* name, const Stage& stage,
                                  const Constants& constants) {
  std::vector<GLuint> numbers;
  std::vector<GLuint> values;
  for (const uint32_t declared : DeclaredConstants(stage.spirv)) {
    const auto given = constants.find(declared);
    if (given == constants.end()) continue;
    numbers.push_back(given->first);
    values.push_back(given->second);
  }
  Shader shader(glCreateShader(stage.type));
  const GLuint shader_name = shader.name();
  glShaderBinary(1, &shader_name, GL_SHADER_BINARY_FORMAT_SPIR_V, stage.spirv.data(),
                 static_cast<GLsizei>(stage.spirv.size_bytes()));
  glSpecializeShader(shader_name, "main", static_cast<GLuint>(numbers.size()), numbers.data(),
                     values.data());
  GLint ok = GL_FALSE;
  glGetShaderiv(shader_name, GL_COMPILE_STATUS, &ok);
  if (ok != GL_TRUE) {
    return absl::InternalError(
        absl::StrCat("shader of ", name, ": ", Log([&](GLsizei size, GLsizei* length, char* text) {
                       glGetShaderInfoLog(shader_name, size, length, text);
                     })));
  }
  return shader;
}

}  // namespace

absl::StatusOr<Program> BuildProgram(const ProgramSource& source, const Constants& constants) {
  Program program(glCreateProgram());
  std::vector<Shader> shaders;
  for (const Stage& stage : source.stages) {
    absl::StatusOr<Shader> shader = BuildStage(source.name, stage, constants);
    if (!shader.ok()) return shader.status();
    glAttachShader(program.name(), shader->name());
    shaders.push_back(*std::move(shader));
  }
  glLinkProgram(program.name());
  GLint ok = GL_FALSE;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &ok);
  if (ok != GL_TRUE) {
    return absl::InternalError(absl::StrCat(
        "program ", source.name, ": ", Log([&](GLsizei size, GLsizei* length, char* text) {
          glGetProgramInfoLog(program.name(), size, length, text);
        })));
  }
  glObjectLabel(GL_PROGRAM, program.name(), -1, source.name);
  return program;
}

absl::StatusOr<GLuint> ProgramCache::Get(const ProgramSource& source, const Constants& constants) {
  const auto key = std::make_pair(&source, constants);
  auto found = programs_.find(key);
  if (found == programs_.end()) {
    absl::StatusOr<Program> program = BuildProgram(source, constants);
    if (!program.ok()) return program.status();
    found = programs_.emplace(key, *std::move(program)).first;
  }
  return found->second.name();
}

}  // namespace halflight::gl
