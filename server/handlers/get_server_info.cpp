#include "server/handlers/get_server_info.h"

#include "server/convert/enums.h"

namespace halflight {

v1::GetServerInfoResponse GetServerInfo(const Backend& backend) {
  v1::GetServerInfoResponse response;
  response.set_server_version(backend.server_version);
  response.set_gl_renderer(backend.device.gl_renderer);
  response.set_gl_version(backend.device.gl_version);

  const ServerLimits& limits = backend.limits;
  v1::ServerLimits& told = *response.mutable_limits();
  told.set_max_particles(limits.max_particles);
  told.set_max_particle_bytes(limits.max_particle_bytes);
  told.set_max_cache_bytes(limits.max_cache_bytes);
  told.set_max_client_set_bytes(limits.max_client_set_bytes);
  told.set_max_client_upload_bytes(limits.max_client_upload_bytes);
  told.set_max_image_size(limits.max_image_size);
  told.set_max_light_buffer_size(limits.max_light_buffer_size);
  told.set_max_slices(limits.max_slices);
  told.set_max_lights(limits.max_lights);
  told.set_max_reference_work(limits.max_reference_work);
  told.set_max_outputs(limits.max_outputs);
  told.set_max_output_bytes(limits.max_output_bytes);
  told.set_max_message_bytes(limits.max_message_bytes);
  told.set_max_queued_frames(limits.max_queued_frames);
  told.set_max_client_frames(limits.max_client_frames);
  told.set_max_frame_bytes(limits.max_frame_bytes);
  told.set_max_client_frame_bytes(limits.max_client_frame_bytes);
  told.set_max_frame_seconds(limits.max_frame_seconds);
  told.set_max_stall_seconds(limits.max_stall_seconds);
  told.set_min_bytes_per_second(limits.min_bytes_per_second);
  told.set_max_calls(limits.max_calls);
  told.set_max_client_calls(limits.max_client_calls);
  told.set_max_partial_uploads(limits.max_partial_uploads);
  told.set_partial_upload_seconds(limits.partial_upload_seconds);
  told.set_max_cache_dir_bytes(limits.max_cache_dir_bytes);
  told.set_max_connections(limits.max_connections);
  told.set_max_client_connections(limits.max_client_connections);
  told.set_max_connection_streams(limits.max_connection_streams);
  told.set_max_handshake_seconds(limits.max_handshake_seconds);
  told.set_max_idle_seconds(limits.max_idle_seconds);

  for (const auto& row : kTechniques) {
    response.add_techniques(row.proto);
  }
  for (const auto& row : kOutputKinds) {
    response.add_output_kinds(row.proto);
  }
  for (const auto& row : kFormats) {
    response.add_formats(row.proto);
  }
  return response;
}

}  // namespace halflight
