// GL objects as move-only values with debug labels; direct state access throughout.
// All calls need the context current on this thread, destructors included.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace halflight::gl {

// What all buffers and textures of the process are at the moment. Any thread.
struct Held {
  uint64_t objects = 0;
  uint64_t bytes = 0;
};
Held HeldMemory();
// One more, or one less.
void CountHeld(size_t bytes);
void UncountHeld(size_t bytes);

// Owns the name of one GL object. Traits::Delete deletes it.
template <typename Traits>
class Object {
 public:
  Object() = default;
  // `bytes`: of memory that counts as held, where it is not 0.
  explicit Object(GLuint name, size_t bytes = 0) : name_(name), bytes_(bytes) {
    if (name_ != 0 && bytes_ != 0) CountHeld(bytes_);
  }
  Object(Object&& other) noexcept
      : name_(std::exchange(other.name_, 0)), bytes_(std::exchange(other.bytes_, 0)) {}
  Object& operator=(Object&& other) noexcept {
    std::swap(name_, other.name_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;
  ~Object() {
    if (name_ == 0) return;
    if (bytes_ != 0) UncountHeld(bytes_);
    Traits::Delete(name_);
  }

  [[nodiscard]] GLuint name() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  GLuint name_ = 0;
  size_t bytes_ = 0;
};

struct BufferTraits {
  static void Delete(GLuint name) { glDeleteBuffers(1, &name); }
};
struct TextureTraits {
  static void Delete(GLuint name) { glDeleteTextures(1, &name); }
};
struct FramebufferTraits {
  static void Delete(GLuint name) { glDeleteFramebuffers(1, &name); }
};
struct VertexArrayTraits {
  static void Delete(GLuint name) { glDeleteVertexArrays(1, &name); }
};
struct ProgramTraits {
  static void Delete(GLuint name) { glDeleteProgram(name); }
};
struct ShaderTraits {
  static void Delete(GLuint name) { glDeleteShader(name); }
};
struct QueryTraits {
  static void Delete(GLuint name) { glDeleteQueries(1, &name); }
};

using Buffer = Object<BufferTraits>;
using Framebuffer = Object<FramebufferTraits>;
using VertexArray = Object<VertexArrayTraits>;
using Program = Object<ProgramTraits>;
using Shader = Object<ShaderTraits>;
using Query = Object<QueryTraits>;

// A buffer of fixed size and contents.
Buffer MakeBuffer(const char* label, std::span<const std::byte> contents);
// The same without contents: only the GPU writes it. `flags` as glNamedBufferStorage.
Buffer MakeBuffer(const char* label, size_t bytes, GLbitfield flags = 0);

template <typename T, typename Allocator>
Buffer MakeBuffer(const char* label, const std::vector<T, Allocator>& values) {
  return MakeBuffer(label, std::as_bytes(std::span(values)));
}
template <typename T>
Buffer MakeBlock(const char* label, const T& block) {
  return MakeBuffer(label, std::as_bytes(std::span(&block, 1)));
}

struct TextureInfo {
  const char* label = "";
  GLenum format = GL_RGBA32F;  // glTextureStorage2D
  int width = 1;
  int height = 1;
  int layers = 0;  // of an array texture; 0: of none
};

// A bilinearly filtered 2D texture, or an array of them, without mipmaps, clamped to its edge,
// which knows its size.
class Texture : public Object<TextureTraits> {
 public:
  Texture() = default;
  explicit Texture(const TextureInfo& info);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  int width_ = 0;
  int height_ = 0;
};

// Renders to the textures as colour attachments 0, 1, ... (an empty place is skipped).
Framebuffer MakeFramebuffer(const char* label, std::initializer_list<const Texture*> colors);

}  // namespace halflight::gl
