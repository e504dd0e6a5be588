// A context and what lives in it, for tests of passes by themselves.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "renderer/gl/debug.h"
#include "renderer/gl/egl_context.h"
#include "renderer/gpu.h"
#include "renderer/readback.h"

namespace halflight::test {

class DeviceTest : public testing::Test {
 protected:
  static Gpu& Device() {
    struct Holder {
      std::unique_ptr<gl::EglContext> context;
      Gpu gpu;
    };
    static const std::unique_ptr<Holder> holder = [] {
      absl::StatusOr<std::unique_ptr<gl::EglContext>> context = gl::EglContext::Create("auto");
      if (!context.ok()) {
        ADD_FAILURE() << context.status();
        std::abort();
      }
      return std::unique_ptr<Holder>(new Holder{*std::move(context), {}});
    }();
    return holder->gpu;
  }

  void SetUp() override { Device(); }

  // No test leaves a GL error behind.
  void TearDown() override {
    const absl::Status status = gl::CheckErrors("test");
    EXPECT_TRUE(status.ok()) << status;
  }
};

// The first `count` records of what the device wrote.
template <typename T>
std::vector<T> ReadBuffer(const gl::Buffer& buffer, size_t count) {
  std::vector<T> values(count);
  if (count == 0) return values;
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  glGetNamedBufferSubData(buffer.name(), 0, static_cast<GLsizeiptr>(count * sizeof(T)),
                          values.data());
  return values;
}

// All four channels of a texture, now.
inline Image ReadTexture(const gl::Texture& texture) {
  Image image{texture.width(), texture.height(), 1, {"R", "G", "B", "A"}, {}};
  Readback(nullptr).Copy(texture, {image});
  return image;
}

}  // namespace halflight::test
