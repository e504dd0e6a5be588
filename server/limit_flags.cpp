#include "server/limit_flags.h"

#include <algorithm>
#include <limits>
#include <string>

#include <fmt/format.h>

#include "renderer/scene.h"

namespace halflight {
namespace {

// CLI11 2.1 takes 010 for eight, -1 for the largest number there is, and larger ones for that too.
bool IsDecimal(const std::string& text) {
  constexpr size_t kMostDigits = 19;  // of what 64 bits hold
  return !text.empty() && text.size() <= kMostDigits &&
         text.find_first_not_of("0123456789") == std::string::npos &&
         (text.size() == 1 || text[0] != '0');
}

}  // namespace

CLI::Validator DecimalNumber() {
  return {[](const std::string& text) {
            return IsDecimal(text) ? "" : text + ", allowed: a whole number from 0 on";
          },
          ""};
}

void AddLimitFlags(CLI::App& app, Options& options) {
  CLI::Option* const cache_dir =
      app.add_option("--cache-dir", options.cache_dir,
                     "Directory in which particle sets outlast the server; made where it is "
                     "missing. Unset: they are kept in memory only")
          ->type_name("DIRECTORY");

  ServerLimits& limits = options.limits;
  const CLI::Validator decimal = DecimalNumber();
  const auto number = [&](const std::string& flag, auto& value, const std::string& help) {
    app.add_option(flag, value, help)->capture_default_str()->check(decimal)->group("Limits");
  };
  const CLI::Validator size(
      [](const std::string& text) {
        const std::string digits = text.substr(0, text.find_first_not_of("0123456789"));
        return IsDecimal(digits) ? "" : text + ", allowed: a size from 0 on";
      },
      "");
  const auto bytes = [&](const std::string& flag, uint64_t& value, const std::string& help) {
    return app.add_option(flag, value, help + "; takes suffixes such as 64MiB")
        ->capture_default_str()
        ->transform(CLI::AsSizeValue(false))
        ->transform(size)  // the last one added looks first
        ->group("Limits");
  };
  number("--max-particles", limits.max_particles, "Particles of one set");
  bytes("--max-particle-bytes", limits.max_particle_bytes, "Bytes of one particle set");
  bytes(
      "--max-cache-bytes", limits.max_cache_bytes,
      "Bytes of all particle sets kept in memory, and as many again of all uploads in progress or "
      "broken off, with particles that open sequences were sent inline");
  bytes("--max-client-set-bytes", limits.max_client_set_bytes,
        "Of these, those of sets that one client's frames need; three quarters if unset");
  bytes("--max-client-upload-bytes", limits.max_client_upload_bytes,
        "Bytes of one client's uploads, and of particles that its sequences were sent inline; "
        "three quarters of --max-cache-bytes if unset");
  bytes("--max-cache-dir-bytes", limits.max_cache_dir_bytes, "Bytes of all particle sets on disk")
      ->needs(cache_dir);
  number("--max-partial-uploads", limits.max_partial_uploads,
         "Uploads that broke off and are kept to be resumed");
  number("--partial-upload-seconds", limits.partial_upload_seconds,
         "How long each of them is kept; 0: none is");
  bytes("--max-reuse-bytes", options.max_reuse_bytes,
        "Bytes of what frames leave to later ones of the same particles, in main memory and on the "
        "device together; 0 reuses nothing");
  number("--frames-in-flight", options.frames_in_flight,
         "Frames drawn at once, one of which is read back while the device draws the others; 0: 2 "
         "on a GPU, 1 on a CPU rasteriser");
  number("--max-image-size", limits.max_image_size,
         "Width and height of an image, times supersampling");
  number("--max-light-buffer-size", limits.max_light_buffer_size, "Texels along a light buffer");
  number("--max-slices", limits.max_slices, "Slices of a frame");
  number("--max-lights", limits.max_lights, "Lights of a frame");
  number("--max-outputs", limits.max_outputs, "Outputs of a frame");
  bytes("--max-output-bytes", limits.max_output_bytes,
        "Pixels of all outputs of a frame, in bytes of 32-bit float");
  number("--max-reference-work", limits.max_reference_work,
         "Samples times particles of which a frame's exact image is evaluated: as technique "
         "REFERENCE, and to measure errors");
  number("--max-queued-frames", limits.max_queued_frames,
         "Frames waiting, rendering or encoding, of all clients together");
  number("--max-client-frames", limits.max_client_frames, "Of these, frames of one client");
  bytes("--max-frame-bytes", limits.max_frame_bytes,
        "Pixels and files of all frames from when they are accepted until they are sent");
  bytes("--max-client-frame-bytes", limits.max_client_frame_bytes,
        "Of these, those of one client's frames; three quarters if unset");
  number("--max-frame-seconds", limits.max_frame_seconds,
         "How long a frame may take once its rendering has begun, without what it waits for other "
         "frames meanwhile; 0: no limit");
  number("--max-stall-seconds", limits.max_stall_seconds,
         "How long a client may leave unread what is sent to it, or an upload unsent, before its "
         "call is ended; 0: for ever");
  bytes(
      "--min-bytes-per-second", limits.min_bytes_per_second,
      "What a client must take of a frame, or send of an upload, in each second that it is waited "
      "for beyond --max-stall-seconds; 0: any byte begins that time anew");
  number("--max-calls", limits.max_calls, "Calls under way");
  number(
      "--max-client-calls", limits.max_client_calls,
      "Of these, those of one client: a tenant, or an address where nobody has to say who calls");
  bytes("--max-message-bytes", limits.max_message_bytes, "Largest message received");
  number("--max-connections", limits.max_connections,
         "Connections of all clients together; fewer where the limit on open files wants it");
  number("--max-client-connections", limits.max_client_connections,
         "Of these, those from one machine; three quarters if unset");
  number("--max-connection-streams", limits.max_connection_streams, "Calls of one connection");
  number("--max-handshake-seconds", limits.max_handshake_seconds,
         "From connecting until TLS and HTTP/2 are set up");
  number("--max-idle-seconds", limits.max_idle_seconds,
         "Of a connection without a call, before it is closed");
}

void FillInShares(const CLI::App& app, ServerLimits& limits) {
  const auto share = [&](const char* flag, uint64_t& value, uint64_t whole, uint64_t one) {
    value = app.count(flag) > 0 ? value : std::max(whole / 4 * 3, one);
  };
  share("--max-client-frame-bytes", limits.max_client_frame_bytes, limits.max_frame_bytes,
        limits.max_output_bytes);
  share("--max-client-set-bytes", limits.max_client_set_bytes, limits.max_cache_bytes,
        limits.max_particle_bytes);
  share("--max-client-upload-bytes", limits.max_client_upload_bytes, limits.max_cache_bytes,
        limits.max_particle_bytes);
  if (app.count("--max-client-connections") == 0) {
    limits.max_client_connections = limits.max_connections - limits.max_connections / 4;
  }
}

void CheckLimits(const Options& options, FieldChecks& checks) {
  const ServerLimits& limits = options.limits;
  checks.InRange("--frames-in-flight", options.frames_in_flight, {.low = 0.0, .high = 16.0});
  // Larger ones overflow the renderer's 32-bit sizes.
  checks.InRange("--max-image-size", limits.max_image_size, {.low = 1.0, .high = 32768.0});
  checks.InRange("--max-light-buffer-size", limits.max_light_buffer_size,
                 {.low = static_cast<double>(kMinLightBufferSize), .high = 32768.0});
  checks.InRange("--max-particles", limits.max_particles, {.low = 1.0, .high = 0x1p31 - 1.0});
  checks.InRange("--max-slices", limits.max_slices, {.low = 1.0, .high = 0x1p31 - 1.0});
  checks.InRange("--max-lights", limits.max_lights, {.low = 0.0, .high = kMaxLights});
  checks.InRange("--max-outputs", limits.max_outputs, {.low = 1.0, .high = 1024.0});
  checks.InRange("--max-output-bytes", limits.max_output_bytes, {.low = 1.0});
  checks.InRange("--max-queued-frames", limits.max_queued_frames, {.low = 1.0, .high = 65536.0});
  checks.InRange("--max-client-frames", limits.max_client_frames, {.low = 1.0, .high = 65536.0});
  checks.InRange("--max-frame-seconds", limits.max_frame_seconds, {.low = 0.0, .high = 86400.0});
  checks.InRange("--max-stall-seconds", limits.max_stall_seconds, {.low = 0.0, .high = 86400.0});
  checks.InRange("--max-calls", limits.max_calls, {.low = 1.0, .high = 1e6});
  checks.InRange("--max-client-calls", limits.max_client_calls, {.low = 1.0, .high = 1e6});
  // What one frame or one set may take must find room.
  const auto at_least = [&](const char* flag, uint64_t value, const char* of, uint64_t one) {
    if (value < one) {
      checks.Reject(flag, fmt::format("{}", value), fmt::format("at least {}, {}", of, one));
    }
  };
  at_least("--max-frame-bytes", limits.max_frame_bytes, "--max-output-bytes",
           limits.max_output_bytes);
  at_least("--max-client-frame-bytes", limits.max_client_frame_bytes, "--max-output-bytes",
           limits.max_output_bytes);
  checks.InRange("--max-reference-work", limits.max_reference_work, {.low = 0.0});
  // Room for a chunk of 64 KiB, the smallest that particles.proto recommends, and what is round it.
  checks.InRange("--max-message-bytes", limits.max_message_bytes,
                 {.low = 128.0 * 1024.0, .high = std::numeric_limits<int32_t>::max()});
  checks.InRange("--max-connections", limits.max_connections, {.low = 1.0, .high = 1e6});
  checks.InRange("--max-client-connections", limits.max_client_connections,
                 {.low = 1.0, .high = 1e6});
  checks.InRange("--max-connection-streams", limits.max_connection_streams,
                 {.low = 1.0, .high = 65536.0});
  checks.InRange("--max-handshake-seconds", limits.max_handshake_seconds,
                 {.low = 1.0, .high = 3600.0});
  checks.InRange("--max-idle-seconds", limits.max_idle_seconds, {.low = 1.0, .high = 86400.0});
  checks.InRange("--max-particle-bytes", limits.max_particle_bytes, {.low = 1.0});
  at_least("--max-cache-bytes", limits.max_cache_bytes, "--max-particle-bytes",
           limits.max_particle_bytes);
  at_least("--max-client-set-bytes", limits.max_client_set_bytes, "--max-particle-bytes",
           limits.max_particle_bytes);
  at_least("--max-client-upload-bytes", limits.max_client_upload_bytes, "--max-particle-bytes",
           limits.max_particle_bytes);
  checks.InRange("--max-partial-uploads", limits.max_partial_uploads,
                 {.low = 0.0, .high = 65536.0});
  checks.InRange("--partial-upload-seconds", limits.partial_upload_seconds,
                 {.low = 0.0, .high = 86400.0 * 365.0});
  if (!options.cache_dir.empty()) {
    at_least("--max-cache-dir-bytes", limits.max_cache_dir_bytes, "--max-particle-bytes",
             limits.max_particle_bytes);
  }
}

}  // namespace halflight
