#include "server/options.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <ostream>
#include <thread>

#include <sys/un.h>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "absl/strings/numbers.h"
#include "renderer/scene.h"
#include "server/convert/field_checks.h"
#include "server/status_text.h"
#include "server/version.h"

namespace halflight {
namespace {

constexpr const char* kLogLevels = "trace, debug, info, warn, error, off";
constexpr double kMaxPort = 65535.0;

// The longest path that a socket address holds, with its final zero.
constexpr size_t kMaxSocketPath = sizeof(sockaddr_un::sun_path) - 1;

void AddFlags(CLI::App& app, Options& options) {
  app.add_option("--address", options.addresses,
                 fmt::format("Where to listen, host:port or unix:path; may be given several times. "
                             "Port 0 takes a free one, which is logged. Default: {}, or what "
                             "systemd hands over",
                             kDefaultAddress))
      ->type_name("ADDRESS");
  app.add_option("--device", options.device,
                 "What to render on: auto, software, uuid:<32 hex digits>, cuda:<index> or "
                 "drm:<path>")
      ->capture_default_str();
  app.add_option("--encode-threads", options.encode_threads,
                 "Threads that encode images; 0: one for each core but one");
  app.add_option("--drain-seconds", options.drain_seconds,
                 "How long what runs may go on after SIGTERM")
      ->capture_default_str();
  app.add_option("--watchdog-seconds", options.watchdog_seconds,
                 "How long the device may not come back from a frame that was cancelled or took "
                 "too long before halflightd ends with exit code 4; 0: for ever")
      ->capture_default_str();
  // For tests, so not listed: drawings that shall find the device failing.
  app.add_option_function<std::string>(
         "--plan-device-faults",
         [&options](const std::string& text) {
           auto faults = PlannedFaults::Parse(text);
           if (!faults.ok()) {
             throw CLI::ValidationError("--plan-device-faults", MessageOf(faults.status()));
           }
           options.faults = std::make_shared<PlannedFaults>(*std::move(faults));
         })
      ->group("");
}

void AddObservabilityFlags(CLI::App& app, Options& options) {
  const char* const group = "Observability";
  app.add_option("--log-level", options.log_level, fmt::format("One of {}", kLogLevels))
      ->capture_default_str()
      ->group(group);
  app.add_option_function<std::string>(
         "--log-format",
         [&options](const std::string& format) {
           options.log_format = format == "json" ? LogFormat::kJson : LogFormat::kText;
         },
         "Of the lines on stderr: text (key=value) or json")
      ->check(CLI::IsMember({"text", "json"}))
      ->default_str("text")
      ->group(group);
  app.add_option("--metrics-address", options.metrics.address,
                 "Where to show metrics to Prometheus, as http://<address>/metrics: host:port or "
                 "unix:path. Unset: nowhere")
      ->type_name("ADDRESS")
      ->group(group);
  app.add_flag("--insecure-metrics", options.metrics.insecure,
               "Show metrics also where others than this machine can connect")
      ->group(group);
  app.add_option_function<std::string>(
         "--channelz",
         [&options](const std::string& serve) {
           options.channelz = serve == "auto" ? std::nullopt : std::optional<bool>(serve == "on");
         },
         "Whether to serve grpc.channelz.v1, which tells everybody who can connect of calls, "
         "connections and their peers' addresses: on, off, or auto: where only this machine can "
         "connect and nobody has to say who calls")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->default_str("auto")
      ->group(group);
}

void AddAccessFlags(CLI::App& app, AccessOptions& access) {
  const auto file = [&app](const std::string& flag, std::string& path, const std::string& help) {
    app.add_option(flag, path, help)->type_name("FILE")->group("Access");
  };
  file("--tls-cert", access.tls.certificate,
       "Certificate chain in PEM: connections are encrypted. Files of this group are read again "
       "when they change");
  file("--tls-key", access.tls.key, "Its private key in PEM");
  file("--tls-client-ca", access.tls.client_authorities,
       "Authorities in PEM whose client certificates say who calls; calls without one, or a token, "
       "are refused");
  file("--token-file", access.token_file,
       "Bearer tokens that say who calls, lines '<SHA-256 of the token in hex> <tenant>'; calls "
       "without one, or a client certificate, are refused");
  app.add_flag("--insecure-listen", access.insecure_listen,
               "Listen also where others than this machine can connect although calls are not "
               "encrypted, or not authenticated")
      ->group("Access");
}

void AddLimitFlags(CLI::App& app, Options& options) {
  CLI::Option* const cache_dir =
      app.add_option("--cache-dir", options.cache_dir,
                     "Directory in which particle sets outlast the server; made where it is "
                     "missing. Unset: they are kept in memory only")
          ->type_name("DIRECTORY");

  ServerLimits& limits = options.limits;
  const auto number = [&app](const std::string& flag, auto& value, const std::string& help) {
    app.add_option(flag, value, help)->capture_default_str()->group("Limits");
  };
  // The conversion of sizes takes -1 for the largest number there is.
  const CLI::Validator not_negative(
      [](const std::string& text) {
        return text.find('-') == std::string::npos ? "" : text + ", allowed: a size from 0 on";
      },
      "");
  const auto bytes = [&](const std::string& flag, uint64_t& value, const std::string& help) {
    return app.add_option(flag, value, help + "; takes suffixes such as 64MiB")
        ->capture_default_str()
        ->transform(CLI::AsSizeValue(false))
        ->transform(not_negative)  // the last one added looks first
        ->group("Limits");
  };
  number("--max-particles", limits.max_particles, "Particles of one set");
  bytes("--max-particle-bytes", limits.max_particle_bytes, "Bytes of one particle set");
  bytes(
      "--max-cache-bytes", limits.max_cache_bytes,
      "Bytes of all particle sets kept in memory, and as many again of all uploads in progress or "
      "broken off");
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
  number("--max-calls", limits.max_calls, "Calls under way");
  number(
      "--max-client-calls", limits.max_client_calls,
      "Of these, those of one client: a tenant, or an address where nobody has to say who calls");
  bytes("--max-message-bytes", limits.max_message_bytes, "Largest message received");
  number("--max-connections", limits.max_connections,
         "Connections of all clients together; fewer where the limit on open files wants it");
  number("--max-connection-streams", limits.max_connection_streams, "Calls of one connection");
  number("--max-handshake-seconds", limits.max_handshake_seconds,
         "From connecting until TLS and HTTP/2 are set up");
  number("--max-idle-seconds", limits.max_idle_seconds,
         "Of a connection without a call, before it is closed");
}

void CheckAddress(const char* flag, const std::string& address, FieldChecks& checks) {
  const std::string allowed = fmt::format(
      "host:port with a port from 0 to 65535, or unix:path of at most {} bytes", kMaxSocketPath);
  if (address.rfind("unix:", 0) == 0) {
    const size_t length = address.size() - std::strlen("unix:");
    if (length == 0 || length > kMaxSocketPath) {
      checks.Reject(flag, address, allowed);
    }
    return;
  }
  const size_t colon = address.rfind(':');
  int port = -1;
  if (colon == std::string::npos || colon == 0 ||
      !absl::SimpleAtoi(address.substr(colon + 1), &port) || port < 0 || port > kMaxPort) {
    checks.Reject(flag, address, allowed);
  }
}

void CheckAddresses(const std::vector<std::string>& addresses, FieldChecks& checks) {
  for (const std::string& address : addresses) {
    CheckAddress("--address", address, checks);
    const bool fixed = address.size() < 2 || address.compare(address.size() - 2, 2, ":0") != 0;
    if (fixed && std::count(addresses.begin(), addresses.end(), address) > 1) {
      checks.Reject("--address", address + " twice", "each address once");
    }
  }
}

void CheckTls(const TlsPaths& tls, FieldChecks& checks) {
  if (tls.key.empty() != tls.certificate.empty()) {
    checks.Reject(tls.key.empty() ? "--tls-key" : "--tls-cert", "\"\"",
                  "certificate and key together");
  }
  if (tls.certificate.empty() && !tls.client_authorities.empty()) {
    checks.Reject("--tls-client-ca", tls.client_authorities, "with --tls-cert and --tls-key");
  }
}

absl::Status Check(const Options& options) {
  FieldChecks checks;
  CheckAddresses(options.addresses, checks);
  CheckTls(options.access.tls, checks);
  if (!options.metrics.address.empty()) {
    CheckAddress("--metrics-address", options.metrics.address, checks);
  }
  const std::vector<std::string> levels = {"trace", "debug", "info", "warn", "error", "off"};
  if (std::find(levels.begin(), levels.end(), options.log_level) == levels.end()) {
    checks.Reject("--log-level", options.log_level, kLogLevels);
  }
  checks.InRange("--encode-threads", options.encode_threads, {.low = 0.0, .high = 256.0});
  checks.InRange("--drain-seconds", options.drain_seconds, {.low = 0.0, .high = 86400.0});
  checks.InRange("--watchdog-seconds", options.watchdog_seconds, {.low = 0.0, .high = 86400.0});

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
  // Room for a chunk of 64 KiB, the smallest that particles.proto recommends, and what is round it.
  checks.InRange("--max-reference-work", limits.max_reference_work, {.low = 0.0});
  checks.InRange("--max-message-bytes", limits.max_message_bytes,
                 {.low = 128.0 * 1024.0, .high = std::numeric_limits<int32_t>::max()});
  checks.InRange("--max-connections", limits.max_connections, {.low = 1.0, .high = 1e6});
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
  return checks.status();
}

// CLI11 does not say whether a wrong value stood in the file, so that both are named.
std::string ParseMessage(const CLI::ParseError& error, const std::string& config_file) {
  const std::string what = error.what();
  const std::string unknown = "INI was not able to parse ";
  if (what.rfind(unknown, 0) == 0) {
    return fmt::format("{}: {}: is no flag, allowed: those that --help lists, without dashes",
                       config_file, what.substr(unknown.size()));
  }
  return config_file.empty() ? what : fmt::format("{} (given, or in {})", what, config_file);
}

}  // namespace

absl::StatusOr<std::optional<Options>> ParseOptions(int argc, const char* const* argv,
                                                    std::ostream& out) {
  Options options;
  CLI::App app("halflightd: renders particle clouds for clients over gRPC", "halflightd");
  app.set_version_flag("--version", std::string("halflightd ") + kVersion);
  AddFlags(app, options);
  AddObservabilityFlags(app, options);
  AddAccessFlags(app, options.access);
  AddLimitFlags(app, options);
  const CLI::Option* const config =
      app.set_config("--config", "",
                     "Flags that are not given are taken from this file: lines "
                     "'<flag> = <value>', the flag without its dashes");
  app.allow_config_extras(CLI::config_extras_mode::error);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    app.exit(success, out, out);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(ParseMessage(error, config->as<std::string>()));
  }
  // Where nothing is said of it a client's share is three quarters, and enough for one.
  ServerLimits& limits = options.limits;
  const auto share = [&](const char* flag, uint64_t& value, uint64_t whole, uint64_t one) {
    value = app.count(flag) > 0 ? value : std::max(whole / 4 * 3, one);
  };
  share("--max-client-frame-bytes", limits.max_client_frame_bytes, limits.max_frame_bytes,
        limits.max_output_bytes);
  share("--max-client-set-bytes", limits.max_client_set_bytes, limits.max_cache_bytes,
        limits.max_particle_bytes);
  share("--max-client-upload-bytes", limits.max_client_upload_bytes, limits.max_cache_bytes,
        limits.max_particle_bytes);
  if (absl::Status status = Check(options); !status.ok()) {
    return status;
  }
  if (options.encode_threads == 0) {
    const auto cores = static_cast<int>(std::thread::hardware_concurrency());
    options.encode_threads = std::max(1, cores - 1);
  }
  if (options.cache_dir.empty()) {
    options.limits.max_cache_dir_bytes = 0;
  }
  return options;
}

}  // namespace halflight
