// The version of halflightd, from the build.
#pragma once

namespace halflight {

inline constexpr const char* kVersion = HALFLIGHT_VERSION;

}  // namespace halflight
