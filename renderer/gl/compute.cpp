#include "renderer/gl/compute.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace halflight::gl {

size_t StorageBlockLimit() {
  GLint64 limit = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
  return static_cast<size_t>(limit);
}

absl::Status CheckStorageBlock(const char* what, size_t bytes) {
  const size_t limit = StorageBlockLimit();
  if (bytes <= limit) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(what, ": ", bytes,
                                                   " bytes, allowed on this device: ", limit,
                                                   " (GL_MAX_SHADER_STORAGE_BLOCK_SIZE)"));
}

void BindStorage(GLuint binding, const Buffer& buffer, size_t record_bytes,
                 const StorageRange& range) {
  glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, buffer.name(),
                    static_cast<GLintptr>(range.first * record_bytes),
                    static_cast<GLsizeiptr>(range.count * record_bytes));
}

void BindStorage(GLuint binding, const Buffer& buffer) {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer.name());
}

void DispatchGroups(size_t groups) {
  constexpr size_t kMaxGroups = 65535;  // GL 4.5, table 23.66
  if (groups == 0) return;
  const size_t rows = DivideUp(groups, kMaxGroups);
  glDispatchCompute(static_cast<GLuint>(DivideUp(groups, rows)), static_cast<GLuint>(rows), 1);
}

uint32_t ReadWord(const Buffer& buffer, size_t index) {
  uint32_t word = 0;
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  glGetNamedBufferSubData(buffer.name(), static_cast<GLintptr>(index * sizeof(word)), sizeof(word),
                          &word);
  return word;
}

}  // namespace halflight::gl
