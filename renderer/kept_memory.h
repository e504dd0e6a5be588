// What becomes of memory that a process frees: frames are made of buffers of megabytes, and taking
// each from the system anew costs as much as filling it several times over. Concerns the process as
// a whole, so only programs call this, no library.
#pragma once

namespace halflight {

// Keeps freed buffers of up to 32 MiB, which is a float RGBA frame of 1920 x 1080, for the next
// ones, in one heap for all threads; the process stays as large as it once was. First thing in
// main, before there are threads. Does nothing without glibc's allocator. What glibc keeps for each
// thread beside it can be bounded by the environment alone: deploy/halflightd.service does.
void KeepFreedMemory();

// Gives what is free back to the system. Milliseconds; any thread. For times without work.
void GiveBackFreedMemory();

}  // namespace halflight
