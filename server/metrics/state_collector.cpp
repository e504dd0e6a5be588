#include "server/metrics/state_collector.h"

#include <chrono>
#include <utility>

#include "server/metrics/families.h"
#include "server/metrics/metrics.h"

namespace halflight {
namespace {

using Families = std::vector<prometheus::MetricFamily>;

template <typename Number>
void AddGauge(Families& to, const char* name, const char* help, Number value) {
  to.push_back(GaugeOf(name, help, {{.value = static_cast<double>(value)}}));
}

template <typename Number>
void AddCounter(Families& to, const char* name, const char* help, Number value) {
  to.push_back(CounterOf(name, help, {{.value = static_cast<double>(value)}}));
}

Sample Labelled(const char* label, const char* of, uint64_t value) {
  return {.labels = {{label, of}}, .value = static_cast<double>(value)};
}

void AddFrames(Families& to, const FramePipeline& pipeline) {
  AddGauge(to, "halflight_frames_queued", "Frames that wait for the renderer", pipeline.waiting());
  AddGauge(to, "halflight_frames_in_progress",
           "Frames accepted and not yet encoded, those that wait among them", pipeline.queued());
  AddGauge(to, "halflight_frame_memory_bytes",
           "What frames hold from when they are accepted until they are sent",
           pipeline.memory_bytes());
}

void AddParticles(Families& to, const ParticleStore& store, const PartialUploads& uploads) {
  const ParticleStore::State state = store.state();
  AddGauge(to, "halflight_cache_bytes", "Particle sets in memory", state.bytes);
  AddGauge(to, "halflight_cache_sets", "Particle sets in memory", state.sets);
  to.push_back(
      CounterOf("halflight_cache_lookups_total", "Particle sets that frames asked for",
                {Labelled("result", "hit", state.hits), Labelled("result", "miss", state.misses)}));
  AddGauge(to, "halflight_disk_cache_bytes", "Particle sets in the cache directory",
           state.disk_bytes);
  AddGauge(to, "halflight_disk_cache_sets", "Particle sets in the cache directory",
           state.disk_sets);
  to.push_back(CounterOf("halflight_disk_cache_reads_total", "Particle sets read from there",
                         {Labelled("result", "ok", state.disk_reads),
                          Labelled("result", "failed", state.failed_disk_reads)}));
  AddGauge(to, "halflight_upload_memory_bytes",
           "Uploads under way or broken off, and inline particles of sequences",
           uploads.memory().used());
  AddGauge(to, "halflight_partial_uploads", "Uploads that broke off and can be resumed",
           uploads.count());
}

void AddServer(Families& to, const GrpcServer& server) {
  std::vector<Sample> calls;
  for (size_t i = 0; i < kRpcs; ++i) {
    calls.push_back(Labelled("rpc", kRpcNames[i], server.calls(static_cast<Rpc>(i))));
  }
  to.push_back(GaugeOf("halflight_calls_in_progress", "Calls under way", std::move(calls)));
  const ConnectionCounts connections = server.connections();
  AddGauge(to, "halflight_connections", "Connections that are open", connections.open);
  AddCounter(to, "halflight_connections_accepted_total", "Connections that were served",
             connections.accepted);
  AddCounter(to, "halflight_connections_refused_total", "Connections that were closed at once",
             connections.refused);
  AddGauge(to, "halflight_serving", "1 while health says SERVING", server.serving() ? 1 : 0);
}

void AddDevice(Families& to, const EngineState& state) {
  AddGauge(to, "halflight_gl_memory_bytes", "What GL objects take on the device", state.gl_bytes);
  AddGauge(to, "halflight_gl_objects", "Buffers and textures", state.gl_objects);
  AddCounter(to, "halflight_device_resets_total", "How often the device was started anew",
             state.device_resets);
  const std::chrono::duration<double> overdue =
      state.overdue_since.has_value() ? std::chrono::steady_clock::now() - *state.overdue_since
                                      : std::chrono::steady_clock::duration{};
  AddGauge(to, "halflight_device_overdue_seconds",
           "For how long it has not come back from a frame that was told to stop", overdue.count());
}

void AddLimits(Families& to, const ServerLimits& limits) {
  to.push_back(GaugeOf("halflight_limit", "Limits that this server was started with",
                       {Labelled("name", "max_queued_frames", limits.max_queued_frames),
                        Labelled("name", "max_frame_bytes", limits.max_frame_bytes),
                        Labelled("name", "max_cache_bytes", limits.max_cache_bytes),
                        Labelled("name", "max_cache_dir_bytes", limits.max_cache_dir_bytes),
                        Labelled("name", "max_calls", limits.max_calls),
                        Labelled("name", "max_connections", limits.max_connections)}));
}

}  // namespace

Families CollectState(const ServerParts& parts) {
  const Backend& backend = parts.backend;
  Families state;
  state.push_back(GaugeOf("halflight_build_info", "Always 1",
                          {{.labels = {{"version", backend.server_version},
                                       {"gl_renderer", backend.device.gl_renderer},
                                       {"gl_version", backend.device.gl_version}},
                            .value = 1.0}}));
  AddServer(state, parts.server);
  AddFrames(state, backend.pipeline);
  AddParticles(state, backend.store, backend.partial_uploads);
  AddDevice(state, parts.engine.state());
  AddLimits(state, backend.limits);
  return state;
}

}  // namespace halflight
