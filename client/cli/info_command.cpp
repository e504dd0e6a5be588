#include "client/cli/info_command.h"

#include <fmt/format.h>

#include <string>

#include "absl/strings/ascii.h"
#include "client/cli/connection.h"
#include "client/cli/flag_values.h"
#include "client/cli/json.h"

namespace halflight::client {

namespace {

// "half_angle" from SHADOW_TECHNIQUE_HALF_ANGLE.
std::string ShortName(const std::string& enumerator, size_t prefix) {
  return absl::AsciiStrToLower(enumerator.size() > prefix ? enumerator.substr(prefix) : enumerator);
}

void Print(const v1::GetServerInfoResponse& info) {
  std::string techniques;
  for (const int technique : info.techniques()) {
    techniques += " " + ShortName(v1::ShadowTechnique_Name(technique), 17);
  }
  std::string outputs;
  for (const int kind : info.output_kinds()) {
    outputs += " " + OutputName(static_cast<v1::OutputKind>(kind));
  }
  std::string formats;
  for (const int format : info.formats()) {
    formats += " " + ShortName(v1::ImageFormat_Name(format), 13);
  }
  const v1::ServerLimits& limits = info.limits();
  fmt::print("halflightd {}\nrenderer: {}\nOpenGL: {}\ntechniques:{}\noutputs:{}\nformats:{}\n",
             info.server_version(), info.gl_renderer(), info.gl_version(), techniques, outputs,
             formats);
  fmt::print(
      "limits: {} particles, {} bytes a set, {} bytes of sets\n"
      "        image side {}, light buffer {}, slices {}, lights {}, outputs {}\n"
      "        {} bytes of output, {} bytes a message, {} frames queued\n"
      "        {} samples times particles of the reference\n"
      "        {} connections of {} calls each, {} s to connect, {} s without a call\n",
      limits.max_particles(), limits.max_particle_bytes(), limits.max_cache_bytes(),
      limits.max_image_size(), limits.max_light_buffer_size(), limits.max_slices(),
      limits.max_lights(), limits.max_outputs(), limits.max_output_bytes(),
      limits.max_message_bytes(), limits.max_queued_frames(), limits.max_reference_work(),
      limits.max_connections(), limits.max_connection_streams(), limits.max_handshake_seconds(),
      limits.max_idle_seconds());
}

}  // namespace

absl::Status RunInfo(const InfoOptions& options, const std::stop_token& stop) {
  auto connection = Connection::Open(options.connection, stop);
  if (!connection.ok()) {
    return connection.status();
  }
  const auto info = connection->client().GetServerInfo();
  if (!info.ok()) {
    return info.status();
  }
  if (options.json) {
    fmt::print("{}\n", JsonOf(*info));
  } else {
    Print(*info);
  }
  return absl::OkStatus();
}

}  // namespace halflight::client
