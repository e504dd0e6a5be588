// A headless GL 4.5 core context on a chosen device; no window system, no environment variables.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "renderer/frame_engine.h"

namespace halflight::gl {

class EglContext {
 public:
  // Makes a context and makes it current on this thread, on which all GL calls and the destructor
  // must then run. `device` as in RenderThreadOptions. InvalidArgument for a device that cannot be
  // parsed, NotFound where no such device exists, Unavailable where none of the candidates gives a
  // usable context; the message says what each of them answered.
  static absl::StatusOr<std::unique_ptr<EglContext>> Create(const std::string& device);

  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  [[nodiscard]] const DeviceInfo& device() const { return device_; }

 private:
  struct Handles;
  EglContext(std::unique_ptr<Handles> handles, DeviceInfo device);

  std::unique_ptr<Handles> handles_;
  DeviceInfo device_;
};

}  // namespace halflight::gl
