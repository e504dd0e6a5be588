#include "server/grpc_server.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>
#include <utility>

#include <google/protobuf/stubs/logging.h>
#include <grpc/compression.h>
#include <grpc/grpc.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/channelz_service_plugin.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include "absl/synchronization/mutex.h"
#include "grpc/health/v1/health.pb.h"
#include "halflight/v1/service.grpc.pb.h"
#include "server/listen/acceptor.h"
#include "server/log/log.h"
#include "server/log/log_budget.h"
#include "server/render_service.h"

namespace halflight {
namespace {

// For what may still be under way when the server goes, such as somebody watching its health.
constexpr std::chrono::milliseconds kShutdownGrace{200};

// gRPC's own complaints belong in the same log, in the same form.
void ForwardLog(gpr_log_func_args* line) {
  static LogBudget budget(20);  // of strangers, too, whose handshakes fail
  LogFields fields = {{"message", line->message}};
  LogLevel level = LogLevel::kDebug;
  if (line->severity == GPR_LOG_SEVERITY_ERROR) {
    if (const auto count = budget.Take()) {
      level = LogLevel::kWarn;
      fields.emplace_back("since_last_told", *count);
    }
  }
  Log(level, "grpc", fields);
}

// Protobuf complains of messages that peers sent, each of which has its error.
void ForwardProtobufLog(google::protobuf::LogLevel level, const char* /*file*/, int /*line*/,
                        const std::string& message) {
  Log(level == google::protobuf::LOGLEVEL_FATAL ? LogLevel::kError : LogLevel::kDebug, "protobuf",
      {{"message", message}});
}

// Reflection is served by threads of gRPC's, one a stream: so many at once, and more are refused.
constexpr int kMaxReflectionThreads = 16;

int Milliseconds(uint32_t seconds) { return static_cast<int>(seconds) * 1000; }

void SetChannelArguments(grpc::ServerBuilder& builder, const ServerLimits& limits) {
  builder.SetMaxReceiveMessageSize(static_cast<int>(limits.max_message_bytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             static_cast<int>(limits.max_connection_streams));
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS,
                             Milliseconds(limits.max_handshake_seconds));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS,
                             Milliseconds(limits.max_idle_seconds));
  // gRPC inflates without a limit, and before anybody is asked who they are.
  for (const auto algorithm : {GRPC_COMPRESS_DEFLATE, GRPC_COMPRESS_GZIP}) {
    builder.SetCompressionAlgorithmSupportStatus(algorithm, false);
  }
  builder.SetResourceQuota(grpc::ResourceQuota("server").SetMaxThreads(kMaxReflectionThreads));
}

bool AllLocal(const std::vector<ListeningSocket>& sockets) {
  return std::all_of(sockets.begin(), sockets.end(),
                     [](const ListeningSocket& socket) { return socket.local(); });
}

void ServeChannelz(const std::vector<ListeningSocket>& sockets) {
  for (const ListeningSocket& socket : sockets) {
    if (!socket.local()) {
      Log(LogLevel::kWarn, "insecure_channelz",
          {{"address", socket.address()},
           {"message", "others than this machine can see who is connected"}});
    }
  }
  grpc::channelz::experimental::InitChannelzService();
}

}  // namespace

struct GrpcServer::Parts {
  Parts(const Backend& backend, const Access& access) : service(backend, access, connections) {}

  Connections connections;
  RenderService service;
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> to_server;
  std::unique_ptr<Acceptor> acceptor;
  std::atomic<bool> serving = true;
};

GrpcServer::GrpcServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

absl::StatusOr<std::unique_ptr<GrpcServer>> GrpcServer::Start(std::vector<ListeningSocket> sockets,
                                                              const Access& access,
                                                              const Backend& backend,
                                                              const GrpcServerOptions& options) {
  gpr_set_log_function(ForwardLog);
  // Abseil looks for deadlocks at each lock of gRPC's where it was built without NDEBUG, as Debian
  // 12 builds it, and keeps a graph of them. Can go with a package that is built otherwise.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  google::protobuf::SetLogHandler(ForwardProtobufLog);
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  if (options.channelz.value_or(!access.authenticates() && AllLocal(sockets))) {
    ServeChannelz(sockets);
  }
  // Never shut down: that would join a thread which still polls connections that have written much,
  // for as long as 10 s after the last call (gRPC 1.51).
  grpc_init();
  // gRPC answers for health without its descriptors; named here, they are linked in for reflection.
  grpc::health::v1::HealthCheckRequest::descriptor();

  auto parts = std::make_unique<Parts>(backend, access);
  grpc::ServerBuilder builder;
  builder.RegisterService(&parts->service.grpc_service());
  SetChannelArguments(builder, backend.limits);
  parts->to_server = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      access.Credentials());
  parts->server = builder.BuildAndStart();
  if (parts->server == nullptr) {
    return absl::InternalError("gRPC could not start its server");
  }
  parts->server->GetHealthCheckService()->SetServingStatus(v1::RenderService::service_full_name(),
                                                           true);
  // The constructor is private. From here on the destructor shuts down.
  std::unique_ptr<GrpcServer> started(new GrpcServer(std::move(parts)));
  for (const ListeningSocket& socket : sockets) {
    // A name may stand for several places.
    if (started->addresses_.empty() || started->addresses_.back() != socket.address()) {
      started->addresses_.push_back(socket.address());
    }
  }
  auto acceptor = Acceptor::Start(
      std::move(sockets), started->parts_->connections,
      {.all = backend.limits.max_connections, .one_machine = backend.limits.max_client_connections},
      [to_server = started->parts_->to_server.get()](int fd) {
        grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
        connection.fd = fd;
        to_server->HandleNewConnection(&connection);
      });
  if (!acceptor.ok()) {
    return acceptor.status();
  }
  started->parts_->acceptor = *std::move(acceptor);
  return started;
}

absl::StatusOr<std::unique_ptr<GrpcServer>> GrpcServer::Start(
    const std::vector<std::string>& addresses, const Backend& backend) {
  static const Access everybody;
  auto sockets = ListeningSocket::BindAll(addresses);
  if (!sockets.ok()) {
    return sockets.status();
  }
  return Start(*std::move(sockets), everybody, backend);
}

GrpcServer::~GrpcServer() {
  // Not left to gRPC: it ends calls that reach it from now on with CANCELLED, which clients do not
  // take for a reason to try elsewhere; a lost connection is UNAVAILABLE.
  if (parts_->acceptor != nullptr) {
    parts_->acceptor->HangUp(kShutdownGrace);
  }
  parts_->acceptor.reset();
  parts_->server->Shutdown(std::chrono::system_clock::now() + kShutdownGrace);
  parts_->server->Wait();
}

bool GrpcServer::serving() const { return parts_->serving; }

void GrpcServer::BeginDrain() {
  parts_->serving = false;
  parts_->server->GetHealthCheckService()->SetServingStatus(false);
  parts_->service.BeginDrain();
  parts_->acceptor->Stop();
}

bool GrpcServer::idle() const { return parts_->service.served_calls() == 0; }

int GrpcServer::calls(Rpc rpc) const { return parts_->service.active_calls(rpc); }

ConnectionCounts GrpcServer::connections() const { return parts_->acceptor->counts(); }

uint64_t GrpcServer::calls_begun() const { return parts_->service.calls_begun(); }

}  // namespace halflight
