// Pixels on their way from the device to images in main memory. Draws nothing.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <vector>

#include <glm/vec2.hpp>

#include "renderer/frame_images.h"
#include "renderer/gl/object.h"
#include "renderer/gl/staging.h"
#include "renderer/image.h"
#include "renderer/scene.h"
#include "renderer/stage_clock.h"

namespace halflight {

// Where pixels go in an image that has its size, layers and channels; its pixels come with them.
struct ImagePlace {
  Image& image;
  glm::ivec2 at{0};  // pixel; the first of the rectangle
  int layer = 0;
  bool add = false;  // R G B to what an earlier copy brought there; its alpha stays
};

// Reads back for one frame. With staging memory copies are only recorded, and arrive once the
// device has come to them; without, each waits for the device and has arrived when it returns. The
// images are the same, and must stay where they are until then. Render thread only.
class Readback {
 public:
  // Held of staging memory at most: a copy beyond it waits until those before it have arrived, and
  // one that is larger by itself needs none.
  static constexpr size_t kMostStagedBytes = size_t{256} << 20U;

  // `staging` may be null, and must outlive this.
  explicit Readback(gl::StagingMemory* staging) : staging_(staging) {}
  ~Readback() { GiveBack(); }
  Readback(const Readback&) = delete;
  Readback& operator=(const Readback&) = delete;

  // Begins the stage of the frame that its copies are: the device's, or the CPU's where they wait.
  void BeginStage(StageClock& clock) const;

  // All of a texture, or a part of it, in the channels of the image: four, R G B, or R.
  // Of an array texture, of one layer.
  void Copy(const gl::Texture& texture, const ImagePlace& to, int layer = 0);
  void Copy(const gl::Texture& texture, const PixelRect& from, const ImagePlace& to, int layer = 0);
  // All pixels of an image of one layer from the floats of a buffer.
  void Copy(const gl::Buffer& buffer, Image& to);

  // After the last copy: what is recorded goes to the device.
  void Submit();
  // Whether the device has come to the end of what was submitted; waits for it, at most for so
  // long.
  [[nodiscard]] bool Arrived(std::chrono::nanoseconds wait) const { return end_.Passed(wait); }
  // Fills the images in; call when all has arrived.
  void Deliver();

 private:
  // Of pixels row by row without gaps.
  struct Pending {
    const float* pixels;
    glm::ivec2 size;
    ImagePlace to;
  };

  // Memory for so many bytes, of the staging block at its offset; null where copies wait.
  struct Staged {
    GLuint buffer = 0;
    size_t offset = 0;
    const float* pixels = nullptr;
  };
  Staged Stage(size_t bytes);
  void WaitAndDeliver();
  void GiveBack();

  gl::StagingMemory* staging_;
  std::vector<gl::StagingMemory::Block> blocks_;
  size_t used_ = 0;    // of the last block
  size_t staged_ = 0;  // bytes of all blocks
  std::vector<Pending> pending_;
  gl::Fence end_;
};

// A frame's images and what brings them: neither is of use without the other.
struct ArrivingImages {
  explicit ArrivingImages(gl::StagingMemory* staging) : readback(staging) {}

  DrawnImages drawn;
  Readback readback;
};

}  // namespace halflight
