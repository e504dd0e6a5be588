#include "renderer/gl/object.h"

#include <array>
#include <atomic>

namespace halflight::gl {

namespace {

std::atomic<uint64_t> held_objects = 0;
std::atomic<uint64_t> held_bytes = 0;

Buffer MakeImmutableBuffer(const char* label, size_t bytes, const void* contents,
                           GLbitfield flags) {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  // A buffer of no bytes cannot be made; an absent attribute still needs something to bind.
  const size_t size = bytes == 0 ? sizeof(float) : bytes;
  glNamedBufferStorage(name, static_cast<GLsizeiptr>(size), bytes == 0 ? nullptr : contents, flags);
  glObjectLabel(GL_BUFFER, name, -1, label);
  return Buffer(name, size);
}

// As the device keeps it.
size_t BytesOf(GLuint texture, const TextureInfo& info) {
  size_t bits = 0;
  for (const GLenum part : {GL_TEXTURE_RED_SIZE, GL_TEXTURE_GREEN_SIZE, GL_TEXTURE_BLUE_SIZE,
                            GL_TEXTURE_ALPHA_SIZE, GL_TEXTURE_DEPTH_SIZE}) {
    GLint size = 0;
    glGetTextureLevelParameteriv(texture, 0, part, &size);
    bits += static_cast<size_t>(size);
  }
  return static_cast<size_t>(info.width) * static_cast<size_t>(info.height) *
         static_cast<size_t>(info.layers > 0 ? info.layers : 1) * bits / 8;
}

Object<TextureTraits> CreateTexture(const TextureInfo& info) {
  GLuint name = 0;
  glCreateTextures(info.layers > 0 ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D, 1, &name);
  if (info.layers > 0) {
    glTextureStorage3D(name, 1, info.format, info.width, info.height, info.layers);
  } else {
    glTextureStorage2D(name, 1, info.format, info.width, info.height);
  }
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glObjectLabel(GL_TEXTURE, name, -1, info.label);
  return Object<TextureTraits>(name, BytesOf(name, info));
}

}  // namespace

Held HeldMemory() { return {held_objects, held_bytes}; }

void CountHeld(size_t bytes) {
  ++held_objects;
  held_bytes += bytes;
}

void UncountHeld(size_t bytes) {
  --held_objects;
  held_bytes -= bytes;
}

Buffer MakeBuffer(const char* label, std::span<const std::byte> contents) {
  return MakeImmutableBuffer(label, contents.size(), contents.data(), 0);
}

Buffer MakeBuffer(const char* label, size_t bytes, GLbitfield flags) {
  return MakeImmutableBuffer(label, bytes, nullptr, flags);
}

Texture::Texture(const TextureInfo& info)
    : Object(CreateTexture(info)), width_(info.width), height_(info.height) {}

Framebuffer MakeFramebuffer(const char* label, std::initializer_list<const Texture*> colors) {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  std::vector<GLenum> draw_buffers;
  for (const Texture* color : colors) {
    const GLenum attachment = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(draw_buffers.size());
    const bool present = color != nullptr && *color;
    if (present) glNamedFramebufferTexture(name, attachment, color->name(), 0);
    draw_buffers.push_back(present ? attachment : GL_NONE);
  }
  glNamedFramebufferDrawBuffers(name, static_cast<GLsizei>(draw_buffers.size()),
                                draw_buffers.data());
  glObjectLabel(GL_FRAMEBUFFER, name, -1, label);
  return Framebuffer(name);
}

}  // namespace halflight::gl
