#include "server/access/tls_credentials.h"

#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>

namespace halflight {

// Asked before every handshake, under gRPC's lock of the one place where connections come in.
class TlsMaterial {
 public:
  explicit TlsMaterial(TlsFiles files)
      : asks_for_certificates_(!files.client_authorities.empty()), fresh_(std::move(files)) {}

  void Replace(TlsFiles files) {
    const std::lock_guard lock(mutex_);
    fresh_ = std::move(files);
  }

  static grpc_ssl_certificate_config_reload_status Fetch(
      void* self, grpc_ssl_server_certificate_config** config) {
    const std::optional<TlsFiles> files = static_cast<TlsMaterial*>(self)->TakeFresh();
    if (!files.has_value()) {
      return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    }
    const grpc_ssl_pem_key_cert_pair pair{files->key.c_str(), files->certificate.c_str()};
    const char* const authorities =
        files->client_authorities.empty() ? nullptr : files->client_authorities.c_str();
    *config = grpc_ssl_server_certificate_config_create(authorities, &pair, 1);
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  [[nodiscard]] bool asks_for_certificates() const { return asks_for_certificates_; }

 private:
  std::optional<TlsFiles> TakeFresh() {
    const std::lock_guard lock(mutex_);
    return std::exchange(fresh_, std::nullopt);
  }

  const bool asks_for_certificates_;
  std::mutex mutex_;
  std::optional<TlsFiles> fresh_;  // not yet fetched
};

namespace {

// The C++ API has no way to these credentials of the C API.
class FetchedCredentials final : public grpc::ServerCredentials {
 public:
  explicit FetchedCredentials(TlsMaterial& material)
      : credentials_(grpc_ssl_server_credentials_create_with_options(
            grpc_ssl_server_credentials_create_options_using_config_fetcher(
                material.asks_for_certificates() ? GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY
                                                 : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE,
                &TlsMaterial::Fetch, &material))) {}
  ~FetchedCredentials() override { grpc_server_credentials_release(credentials_); }
  FetchedCredentials(const FetchedCredentials&) = delete;
  FetchedCredentials& operator=(const FetchedCredentials&) = delete;

  // Would look at each call before the service does; access.h looks instead.
  void SetAuthMetadataProcessor(
      const std::shared_ptr<grpc::AuthMetadataProcessor>& /*processor*/) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  grpc_server_credentials* const credentials_;
};

}  // namespace

ReloadedTls::ReloadedTls(TlsFiles files)
    : material_(std::make_unique<TlsMaterial>(std::move(files))) {}

ReloadedTls::~ReloadedTls() = default;

void ReloadedTls::Replace(TlsFiles files) { material_->Replace(std::move(files)); }

std::shared_ptr<grpc::ServerCredentials> ReloadedTls::Credentials() {
  return std::make_shared<FetchedCredentials>(*material_);
}

}  // namespace halflight
