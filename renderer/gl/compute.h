// What compute passes share: dispatches of any size, storage within the device's limits, and single
// words read back. Knows no pass.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "renderer/gl/object.h"

namespace halflight::gl {

// The largest part of a buffer that a shader sees at once (GL_MAX_SHADER_STORAGE_BLOCK_SIZE).
size_t StorageBlockLimit();

// OK where a shader may see `bytes` of a buffer at once, else ResourceExhausted, naming `what` and
// the limit.
absl::Status CheckStorageBlock(const char* what, size_t bytes);

// Part of a buffer of records by place: what a shader sees of places [first, end). Bindings begin
// at multiples of the device's alignment, at most 256 bytes (GL 4.5, table 23.64).
struct StorageRange {
  size_t first = 0;  // place
  size_t count = 0;
};

// Binds `count` records of `record_bytes` from the first on, whose offset must be a multiple of 256
// bytes.
void BindStorage(GLuint binding, const Buffer& buffer, size_t record_bytes,
                 const StorageRange& range);
// Binds all of a buffer.
void BindStorage(GLuint binding, const Buffer& buffer);

// Dispatches at least `groups` workgroups in two dimensions, since one is limited to 65,535:
// shaders number them by WorkgroupIndex() of shaders/workgroup.glsl and ignore those in excess.
void DispatchGroups(size_t groups);

constexpr size_t DivideUp(size_t count, size_t size) { return (count + size - 1) / size; }

// Waits for what was dispatched and reads a word that it wrote.
uint32_t ReadWord(const Buffer& buffer, size_t index);

}  // namespace halflight::gl
