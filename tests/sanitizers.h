// Whether this was compiled with a sanitizer, for the few tests that ask what one changes: the
// allocator, or what it can do itself.
#pragma once

namespace halflight::testing {

#ifndef __has_feature
#define __has_feature(feature) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace halflight::testing
