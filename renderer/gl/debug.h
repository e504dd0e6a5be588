// Names for stretches of GL commands in debuggers, and GL errors as statuses.
#pragma once

#include <epoxy/gl.h>

#include "absl/status/status.h"

namespace halflight::gl {

// Groups the commands of its lifetime under a name (KHR_debug).
class DebugScope {
 public:
  explicit DebugScope(const char* name) {
    glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, name);
  }
  ~DebugScope() { glPopDebugGroup(); }
  DebugScope(const DebugScope&) = delete;
  DebugScope& operator=(const DebugScope&) = delete;
};

// Forgets what GL reported so far: what a frame that ended early left behind is not the next one's.
void ForgetErrors();

// OK, or an error with the name of `where` and what GL reported since the last call:
// ResourceExhausted when the device is out of memory, else Internal.
absl::Status CheckErrors(const char* where);

}  // namespace halflight::gl
