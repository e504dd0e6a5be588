// glibc's settings for it, mallopt(3).
#include "renderer/kept_memory.h"

#include <cstdlib>  // defines __GLIBC__

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace halflight {

#ifdef __GLIBC__

void KeepFreedMemory() {
  constexpr int kLargestMmapThreshold = 32 << 20;  // that mallopt takes
  mallopt(M_MMAP_THRESHOLD, kLargestMmapThreshold);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  // What the renderer's thread takes, an encoder's frees: with a heap for each thread that memory
  // would wait for the one that took it.
  mallopt(M_ARENA_MAX, 1);
}

void GiveBackFreedMemory() { malloc_trim(0); }

#else

void KeepFreedMemory() {}
void GiveBackFreedMemory() {}

#endif

}  // namespace halflight
