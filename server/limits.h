// What the server accepts at most. Only numbers: the checks stand where a value is read.
#pragma once

#include <algorithm>
#include <cstdint>

#include "renderer/frame_engine.h"

namespace halflight {

inline constexpr uint64_t kMiB = uint64_t{1} << 20U;
inline constexpr uint64_t kGiB = uint64_t{1} << 30U;

// See ServerLimits in service.proto for the meaning of each.
struct ServerLimits {
  uint64_t max_particles = 50'000'000;
  uint64_t max_particle_bytes = 1 * kGiB;
  uint64_t max_cache_bytes =
      4 * kGiB;  // also bounds what uploads and inline sets of sequences hold
  uint64_t max_client_set_bytes = 3 * kGiB;  // of sets that frames of one client need
  uint64_t max_client_upload_bytes = 3 * kGiB;
  uint32_t max_image_size = 8192;
  uint32_t max_light_buffer_size = 4096;
  uint32_t max_slices = 65536;
  uint32_t max_lights = 8;
  uint32_t max_outputs = 16;
  uint64_t max_output_bytes = 1 * kGiB;
  uint64_t max_message_bytes = 2 * kMiB;
  uint32_t max_queued_frames = 64;
  uint32_t max_client_frames = 48;
  uint64_t max_frame_bytes = 4 * kGiB;
  uint64_t max_client_frame_bytes = 3 * kGiB;
  uint32_t max_frame_seconds = 600;
  uint32_t max_stall_seconds = 60;
  uint64_t min_bytes_per_second = 8192;
  uint32_t max_calls = 4096;
  uint32_t max_client_calls = 3072;
  // Samples times particles: about a minute on two cores where particles overlap a few hundred
  // deep.
  uint64_t max_reference_work = 400'000'000'000;
  uint32_t max_partial_uploads = 64;
  uint32_t partial_upload_seconds = 600;
  uint64_t max_cache_dir_bytes = 16 * kGiB;  // 0: there is no cache directory
  uint32_t max_connections = 4096;
  uint32_t max_client_connections = 3072;
  uint32_t max_connection_streams = 100;
  uint32_t max_handshake_seconds = 10;
  uint32_t max_idle_seconds = 3600;
};

inline constexpr uint32_t kMinLightBufferSize = 16;

// The limits that still hold when the device cannot have textures as large as allowed. Images may
// be larger: they are drawn in bands.
inline ServerLimits LimitsOnDevice(ServerLimits limits, const DeviceInfo& device) {
  if (device.max_texture_size > 0) {
    const auto largest = static_cast<uint32_t>(device.max_texture_size);
    limits.max_light_buffer_size = std::min(limits.max_light_buffer_size, largest);
  }
  return limits;
}

}  // namespace halflight
