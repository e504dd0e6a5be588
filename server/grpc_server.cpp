#include "server/grpc_server.h"

#include <chrono>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>

#include "server/render_service.h"
#include "server/status_text.h"
#include "server/unix_socket.h"

namespace halflight {
namespace {

// For what may still be under way when the server goes, such as somebody watching its health.
constexpr std::chrono::milliseconds kShutdownGrace{200};

// gRPC's own complaints belong in the same log, in the same form.
void ForwardLog(gpr_log_func_args* line) {
  if (line->severity == GPR_LOG_SEVERITY_ERROR) {
    spdlog::warn("grpc message=\"{}\"", line->message);
  } else {
    spdlog::debug("grpc message=\"{}\"", line->message);
  }
}

std::string WithPort(const std::string& address, int port) {
  return address.substr(0, address.rfind(':') + 1) + std::to_string(port);
}

}  // namespace

struct GrpcServer::Parts {
  explicit Parts(const Backend& backend) : service(backend) {}

  RenderService service;
  std::unique_ptr<grpc::Server> server;
};

GrpcServer::GrpcServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

absl::StatusOr<std::unique_ptr<GrpcServer>> GrpcServer::Start(
    const std::vector<std::string>& addresses, const Backend& backend) {
  gpr_set_log_function(ForwardLog);
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  auto parts = std::make_unique<Parts>(backend);
  grpc::ServerBuilder builder;
  builder.RegisterService(&parts->service.grpc_service());
  builder.SetMaxReceiveMessageSize(static_cast<int>(backend.limits.max_message_bytes));
  // Otherwise a second server would share the port, and the calls.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  std::vector<int> ports(addresses.size(), 0);
  for (size_t i = 0; i < addresses.size(); ++i) {
    if (const std::string path = SocketPath(addresses[i]); !path.empty()) {
      if (const absl::Status status = RemoveStaleSocket(path); !status.ok()) {
        return Prefixed(fmt::format("--address {}: ", addresses[i]), status);
      }
    }
    builder.AddListeningPort(addresses[i], grpc::InsecureServerCredentials(), &ports[i]);
  }
  parts->server = builder.BuildAndStart();
  // A port that stayed 0 is where gRPC gave up.
  for (size_t i = 0; i < addresses.size(); ++i) {
    if (ports[i] == 0) {
      return absl::UnavailableError(fmt::format(
          "--address {}: cannot listen there: in use, not an address of this machine, or not "
          "permitted",
          addresses[i]));
    }
  }
  if (parts->server == nullptr) {
    return absl::InternalError("gRPC could not start its server");
  }

  // The constructor is private.
  std::unique_ptr<GrpcServer> started(new GrpcServer(std::move(parts)));
  for (size_t i = 0; i < addresses.size(); ++i) {
    started->addresses_.push_back(
        SocketPath(addresses[i]).empty() ? WithPort(addresses[i], ports[i]) : addresses[i]);
  }
  return started;
}

GrpcServer::~GrpcServer() {
  parts_->server->Shutdown(std::chrono::system_clock::now() + kShutdownGrace);
  parts_->server->Wait();
  RemoveSocketFiles();
}

void GrpcServer::BeginDrain() {
  parts_->service.BeginDrain();
  parts_->server->GetHealthCheckService()->SetServingStatus(false);
}

bool GrpcServer::idle() const { return parts_->service.active_calls() == 0; }

uint64_t GrpcServer::calls_begun() const { return parts_->service.calls_begun(); }

void GrpcServer::RemoveSocketFiles() const {
  for (const std::string& address : addresses_) {
    if (const std::string path = SocketPath(address); !path.empty()) {
      unlink(path.c_str());
    }
  }
}

}  // namespace halflight
