// A server with none of halflightd's protections, to show that the soak notices: gRPC's own
// listener, OK to every call whatever is sent, but for one method that it never answers, and
// memory that is kept of each call.

#include <cstring>
#include <iostream>
#include <mutex>
#include <string>
#include <vector>

#include <grpcpp/ext/health_check_service_server_builder_option.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

namespace {

class OkToEverything : public grpc::ServerGenericBidiReactor {
 public:
  explicit OkToEverything(const std::string& method)
      : answers_(method != "/halflight.v1.RenderService/FindMissingParticles") {
    StartRead(&message_);
  }
  void OnReadDone(bool ok) override {
    if (ok) {
      StartRead(&message_);
    } else if (answers_) {
      Finish(grpc::Status::OK);
    }
  }
  void OnCancel() override {
    if (!answers_) {
      Finish(grpc::Status::CANCELLED);
    }
  }
  void OnDone() override { delete this; }

 private:
  const bool answers_;
  grpc::ByteBuffer message_;
};

class Service : public grpc::CallbackGenericService {
  grpc::ServerGenericBidiReactor* CreateReactor(
      grpc::GenericCallbackServerContext* context) override {
    {
      const std::lock_guard lock(mutex_);
      kept_.emplace_back(size_t{1} << 20U, 'x');
    }
    return new OkToEverything(context->method());
  }

  std::mutex mutex_;
  std::vector<std::string> kept_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::strcmp(argv[1], "--help") == 0) {
    return 0;
  }
  grpc::EnableDefaultHealthCheckService(true);
  Service service;
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterCallbackGenericService(&service);
  const auto server = builder.BuildAndStart();
  std::cerr << "listening address=127.0.0.1:" << port << std::endl;
  server->Wait();
  return 0;
}
