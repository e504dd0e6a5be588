#include "renderer/readback.h"

#include <algorithm>
#include <utility>

#include "renderer/pixel_memory.h"

namespace halflight {

namespace {

// A block serves several copies: light buffers, layers and small images are less than this.
constexpr size_t kLeastBlockBytes = size_t{8} << 20U;

size_t ValueCount(const Image& image, const glm::ivec2& size) {
  return static_cast<size_t>(size.x) * static_cast<size_t>(size.y) * image.channels.size();
}

// Of one layer.
size_t ValueCount(const Image& image) { return ValueCount(image, {image.width, image.height}); }

bool IsWhole(const ImagePlace& to, const glm::ivec2& size) {
  return to.image.layers == 1 && size == glm::ivec2(to.image.width, to.image.height);
}

void AddColors(const float* from, size_t count, float* to) {
  for (size_t i = 0; i < count; ++i) {
    if (i % 4 != 3) to[i] += from[i];
  }
}

// `pixels` row by row without gaps, into the rectangle of `size`.
void Place(const float* pixels, const glm::ivec2& size, const ImagePlace& to) {
  Image& image = to.image;
  if (IsWhole(to, size) && !to.add) {
    ReservePixels(ValueCount(image), image.pixels);
    image.pixels.assign(pixels, pixels + ValueCount(image));
    return;
  }
  if (image.pixels.empty()) {
    image.pixels = Zeros(ValueCount(image) * static_cast<size_t>(image.layers));
  }
  const size_t channels = image.channels.size();
  const size_t row_values = channels * static_cast<size_t>(size.x);
  const size_t layer = ValueCount(image) * static_cast<size_t>(to.layer);
  for (int y = 0; y < size.y; ++y) {
    const float* const from = pixels + static_cast<size_t>(y) * row_values;
    const size_t first = static_cast<size_t>(to.at.y + y) * static_cast<size_t>(image.width) +
                         static_cast<size_t>(to.at.x);
    float* const row = &image.pixels[layer + first * channels];
    if (to.add) {
      AddColors(from, row_values, row);
    } else {
      std::copy_n(from, row_values, row);
    }
  }
}

GLenum FormatOf(const Image& image) {
  switch (image.channels.size()) {
    case 1:
      return GL_RED;
    case 3:
      return GL_RGB;
    default:
      return GL_RGBA;
  }
}

void GetPixels(const gl::Texture& texture, const PixelRect& from, int layer, GLenum format,
               size_t bytes, void* to) {
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glGetTextureSubImage(texture.name(), 0, from.x, from.y, layer, from.width, from.height, 1, format,
                       GL_FLOAT, static_cast<GLsizei>(bytes), to);
}

// Calls `get` with memory that it fills, and puts that where it belongs.
template <typename Get>
void PlaceNow(const glm::ivec2& size, const ImagePlace& to, const Get& get) {
  if (IsWhole(to, size) && !to.add) {
    to.image.pixels = Zeros(ValueCount(to.image));
    get(to.image.pixels.data());
    return;
  }
  std::vector<float> pixels(ValueCount(to.image, size));
  get(pixels.data());
  Place(pixels.data(), size, to);
}

}  // namespace

void Readback::BeginStage(StageClock& clock) const {
  if (staging_ != nullptr) {
    clock.BeginGpu("copy");
  } else {
    clock.BeginCpu("readback");
  }
}

void Readback::Copy(const gl::Texture& texture, const ImagePlace& to, int layer) {
  Copy(texture, {0, 0, texture.width(), texture.height()}, to, layer);
}

void Readback::Copy(const gl::Texture& texture, const PixelRect& from, const ImagePlace& to,
                    int layer) {
  const glm::ivec2 size(from.width, from.height);
  const size_t bytes = ValueCount(to.image, size) * sizeof(float);
  const GLenum format = FormatOf(to.image);
  const Staged staged = Stage(bytes);
  if (staged.pixels == nullptr) {
    PlaceNow(size, to,
             [&](float* pixels) { GetPixels(texture, from, layer, format, bytes, pixels); });
    return;
  }
  glBindBuffer(GL_PIXEL_PACK_BUFFER, staged.buffer);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): what GL takes for the offset into the buffer
  GetPixels(texture, from, layer, format, bytes, reinterpret_cast<void*>(staged.offset));
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  pending_.push_back({staged.pixels, size, to});
}

void Readback::Copy(const gl::Buffer& buffer, Image& image) {
  const ImagePlace to{image};
  const glm::ivec2 size(image.width, image.height);
  const auto bytes = static_cast<GLsizeiptr>(ValueCount(image) * sizeof(float));
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  const Staged staged = Stage(static_cast<size_t>(bytes));
  if (staged.pixels == nullptr) {
    PlaceNow(size, to,
             [&](float* pixels) { glGetNamedBufferSubData(buffer.name(), 0, bytes, pixels); });
    return;
  }
  glCopyNamedBufferSubData(buffer.name(), staged.buffer, 0, static_cast<GLintptr>(staged.offset),
                           bytes);
  pending_.push_back({staged.pixels, size, to});
}

Readback::Staged Readback::Stage(size_t bytes) {
  if (staging_ == nullptr) return {};
  const bool fits = !blocks_.empty() && used_ + bytes <= blocks_.back().bytes;
  if (!fits) {
    // Copies into one image come in order, so none may wait while a later one does not.
    if (staged_ + bytes > kMostStagedBytes) WaitAndDeliver();
    if (bytes > kMostStagedBytes) return {};
    gl::StagingMemory::Block block = staging_->Take(std::max(bytes, kLeastBlockBytes));
    if (block.contents == nullptr) {
      WaitAndDeliver();
      return {};
    }
    staged_ += block.bytes;
    used_ = 0;
    blocks_.push_back(std::move(block));
  }
  const gl::StagingMemory::Block& block = blocks_.back();
  // Its GL name, not the block, goes on: those move.
  const Staged staged{block.buffer.name(), used_,
                      reinterpret_cast<const float*>(block.contents + used_)};
  used_ += bytes;
  return staged;
}

void Readback::WaitAndDeliver() {
  Submit();
  while (!Arrived(std::chrono::seconds(1))) {
  }
  Deliver();
}

void Readback::Submit() {
  if (!pending_.empty()) end_ = gl::Fence::Insert();
}

void Readback::Deliver() {
  for (const Pending& copy : pending_) Place(copy.pixels, copy.size, copy.to);
  GiveBack();
}

void Readback::GiveBack() {
  pending_.clear();
  for (gl::StagingMemory::Block& block : blocks_) staging_->GiveBack(std::move(block));
  blocks_.clear();
  used_ = staged_ = 0;
}

}  // namespace halflight
