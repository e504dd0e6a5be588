#include "renderer/gl/debug.h"

#include "absl/strings/str_cat.h"

namespace halflight::gl {

void ForgetErrors() {
  while (glGetError() != GL_NO_ERROR) {
  }
}

absl::Status CheckErrors(const char* where) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return absl::OkStatus();
  ForgetErrors();
  if (error == GL_OUT_OF_MEMORY) {
    return absl::ResourceExhaustedError(absl::StrCat(where, ": the device is out of memory"));
  }
  return absl::InternalError(absl::StrCat(where, ": GL error 0x", absl::Hex(error)));
}

}  // namespace halflight::gl
