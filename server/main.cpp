// halflightd: flags, engine, service, wait, drain. What any of them does stands elsewhere.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "renderer/kept_memory.h"
#include "renderer/render_thread.h"
#include "server/access/access.h"
#include "server/grpc_server.h"
#include "server/listen/acceptor.h"
#include "server/listen/listening_socket.h"
#include "server/log/log.h"
#include "server/metrics/metrics_page.h"
#include "server/metrics/metrics_server.h"
#include "server/metrics/prometheus_metrics.h"
#include "server/options.h"
#include "server/particle_files.h"
#include "server/service_manager.h"
#include "server/status_text.h"
#include "server/supervision.h"
#include "server/termination_watch.h"
#include "server/version.h"

namespace {

using namespace halflight;  // NOLINT(google-build-using-namespace): the whole program is of it

// docs/operations.md says what they mean.
constexpr int kExitCannotStart = 1;
constexpr int kExitBadFlags = 2;
constexpr int kExitCutShort = 3;
constexpr int kExitDeviceLost = 4;

// How long destructors may take, once nothing is under way any more.
constexpr std::chrono::seconds kPuttingAway{10};

// How long what does not need a device that was lost may go on, such as telling clients of it.
constexpr std::chrono::seconds kAfterDeviceLost{2};

sigset_t BlockTerminationSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

// In the log where that is to be JSON, and nothing else.
int Fail(int code, const absl::Status& status, const Options& options) {
  if (options.log_format == LogFormat::kJson && options.log_level != "off") {
    Log(LogLevel::kError, "cannot_start", {{"message", MessageOf(status)}});
  } else {
    std::cerr << "halflightd: " << status.message() << "\n";
  }
  return code;
}

PipelineOptions PipelineOptionsOf(const Options& options, const ServerLimits& limits,
                                  Metrics& metrics) {
  PipelineOptions pipeline{.admission = {.max_queued_frames = limits.max_queued_frames,
                                         .max_client_frames = limits.max_client_frames,
                                         .max_frame_bytes = limits.max_frame_bytes,
                                         .max_client_frame_bytes = limits.max_client_frame_bytes,
                                         .max_client_set_bytes = limits.max_client_set_bytes},
                           .encode_threads = options.encode_threads,
                           .warm_up = true,
                           .metrics = &metrics,
                           .server_version = kVersion};
  if (limits.max_frame_seconds > 0) {
    pipeline.max_frame_time = std::chrono::seconds(limits.max_frame_seconds);
  }
  return pipeline;
}

int Run(const Options& options, std::vector<ListeningSocket> inherited, const sigset_t& signals) {
  // The last to go.
  std::optional<TerminationWatch> watch(
      std::in_place, signals, std::nullopt,
      ImmediateEnd{EXIT_SUCCESS, "stopped", "told so while it was starting"});
  const auto fail = [&options](int code, const absl::Status& status) {
    return Fail(code, status, options);
  };
  // What can be wrong with flags and files shows before the device is started.
  const auto access = Access::Load(options.access);
  if (!access.ok()) {
    return fail(kExitCannotStart, access.status());
  }
  std::vector<std::string> addresses = options.addresses;
  if (addresses.empty() && inherited.empty()) {
    addresses.emplace_back(kDefaultAddress);
  }
  auto sockets = ListeningSocket::BindAll(addresses, std::move(inherited));
  if (!sockets.ok()) {
    return fail(kExitCannotStart, sockets.status());
  }
  if (absl::Status status = CheckReach(*sockets, **access, options.access.insecure_listen);
      !status.ok()) {
    return fail(kExitBadFlags, status);
  }
  auto metrics_sockets = BindMetricsAddress(options.metrics);
  if (!metrics_sockets.ok()) {
    return fail(
        absl::IsInvalidArgument(metrics_sockets.status()) ? kExitBadFlags : kExitCannotStart,
        metrics_sockets.status());
  }

  auto engine =
      StartRenderThread({.device = options.device,
                         .max_queued_frames = static_cast<int>(options.limits.max_queued_frames),
                         .renderer = {.max_reuse_bytes = options.max_reuse_bytes,
                                      .frames_in_flight = options.frames_in_flight,
                                      .faults = options.faults},
                         // Planned faults are those of clients' frames.
                         .warm_up = options.faults == nullptr});
  if (!engine.ok()) {
    return fail(kExitCannotStart, engine.status());
  }
  const DeviceInfo& device = (*engine)->device();
  Log(LogLevel::kInfo, "device",
      {{"renderer", device.gl_renderer},
       {"gl", device.gl_version},
       {"software", device.software},
       {"tells_of_resets", device.tells_of_resets}});

  // Each uses those above it, and is gone before them.
  PrometheusMetrics counted;
  ServerLimits limits = LimitsOnDevice(options.limits, device);
  limits.max_connections = std::min(limits.max_connections, RoomForConnections());
  if (limits.max_connections < options.limits.max_connections) {
    const bool shared = limits.max_client_connections < options.limits.max_connections;
    const uint32_t most = limits.max_connections - (shared ? limits.max_connections / 4 : 0);
    limits.max_client_connections = std::min(limits.max_client_connections, most);
    Log(LogLevel::kWarn, "fewer_connections",
        {{"max", limits.max_connections},
         {"message", "than --max-connections, for want of open files"}});
  }
  const std::string version = kVersion;
  std::unique_ptr<ParticleFiles> files;
  if (!options.cache_dir.empty()) {
    auto opened = ParticleFiles::Open(options.cache_dir, limits);
    if (!opened.ok()) {
      return fail(kExitCannotStart, Prefixed("--cache-dir ", opened.status()));
    }
    files = *std::move(opened);
  }
  // Before the store, whose threads may be the last to hold a call.
  ByteBudget upload_memory(limits.max_cache_bytes, limits.max_client_upload_bytes);
  ParticleStore store(limits.max_cache_bytes, std::move(files));
  PartialUploads partial_uploads(upload_memory,
                                 {.max_count = limits.max_partial_uploads,
                                  .max_age = std::chrono::seconds(limits.partial_upload_seconds)});
  Metrics& metrics = metrics_sockets->empty() ? Metrics::None() : counted;
  FramePipeline pipeline(**engine, PipelineOptionsOf(options, limits, metrics));
  const Backend backend{device, limits, version, store, partial_uploads, pipeline, metrics};
  auto server =
      GrpcServer::Start(*std::move(sockets), **access, backend, {.channelz = options.channelz});
  if (!server.ok()) {
    return fail(kExitCannotStart, server.status());
  }
  auto shown = ShowMetrics(*std::move(metrics_sockets), counted, {**engine, backend, **server});
  if (!shown.ok()) {
    return fail(kExitCannotStart, shown.status());
  }
  watch.reset();  // from now on a signal is a drain's
  for (const std::string& address : (*server)->addresses()) {
    Log(LogLevel::kInfo, "listening", {{"address", address}});
  }
  NotifyServiceManager("READY=1");

  Supervision supervision(**server, **engine, backend, signals,
                          std::chrono::seconds(options.watchdog_seconds));
  const std::optional<int> signal = supervision.WaitForEnd();
  NotifyServiceManager("STOPPING=1");
  if (!signal.has_value()) {
    // What waits for the device waits for ever, and so would everything's destructors.
    supervision.Drain(kAfterDeviceLost);
    std::_Exit(kExitDeviceLost);
  }
  Log(LogLevel::kInfo, "draining", {{"signal", *signal}, {"drain_seconds", options.drain_seconds}});
  if (!supervision.Drain(std::chrono::seconds(options.drain_seconds))) {
    // At once: what runs may be stuck, so nothing is waited for.
    Log(LogLevel::kError, "cut_short",
        {{"message", "stopped before the calls under way were finished"}});
    std::_Exit(kExitCutShort);
  }
  Log(LogLevel::kInfo, "stopped");
  watch.emplace(signals, kPuttingAway,
                ImmediateEnd{kExitCutShort, "cut_short", "stopped before all was put away"});
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = ParseOptions(argc, argv, std::cout);
  if (!options.ok()) {
    return Fail(kExitBadFlags, options.status(), {});
  }
  if (!options->has_value()) {
    return EXIT_SUCCESS;
  }
  KeepFreedMemory();
  // A file that may not grow, and a log that nobody reads any more, are errors of the write, not
  // the end of the server.
  signal(SIGXFSZ, SIG_IGN);
  signal(SIGPIPE, SIG_IGN);
  // Before any thread is made: all of them inherit the mask.
  const sigset_t signals = BlockTerminationSignals();
  StartLog((*options)->log_level, (*options)->log_format);
  auto inherited = TakeInheritedSockets();
  if (!inherited.ok()) {
    return Fail(kExitCannotStart, inherited.status(), **options);
  }
  return Run(**options, *std::move(inherited), signals);
}
