// Who gets in: how connections are secured, and who the caller of a call is. Holds no calls.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_context.h>

#include "absl/status/statusor.h"
#include "server/access/file_watch.h"
#include "server/access/tls_credentials.h"
#include "server/access/tls_files.h"
#include "server/access/token_table.h"
#include "server/listen/listening_socket.h"

namespace halflight {

struct AccessOptions {
  TlsPaths tls{};            // without a certificate: connections are in plain text
  std::string token_file{};  // as TokenTable reads it; empty: no tokens
  // Whether to listen where others than this machine can connect although calls are not encrypted
  // or not authenticated.
  bool insecure_listen = false;
};

class Access {
 public:
  // Lets everybody in, in plain text.
  Access() = default;
  ~Access() = default;
  Access(const Access&) = delete;
  Access& operator=(const Access&) = delete;

  // Reads the files now, and again whenever they change: one that is damaged then is told in the
  // log, and what was read before stays. InvalidArgument "--<flag>: <path>: <why>".
  static absl::StatusOr<std::unique_ptr<Access>> Load(const AccessOptions& options);

  [[nodiscard]] bool encrypts() const { return tls_ != nullptr; }
  // Whether a call has to say who asks.
  [[nodiscard]] bool authenticates() const { return tokens() != nullptr || trusts_certificates_; }

  // For one server; this outlives it.
  [[nodiscard]] std::shared_ptr<grpc::ServerCredentials> Credentials() const;

  // Whose call it is: a tenant, or "" where nobody has to say. A token ("authorization: Bearer
  // <token>") goes before a certificate; of a certificate the tenant is its first URI, else its
  // first DNS name, else its common name. Unauthenticated where none of them is known here. Any
  // thread.
  [[nodiscard]] absl::StatusOr<std::string> TenantOf(const grpc::ServerContextBase& context) const;

 private:
  absl::StatusOr<std::string> TenantOf(const grpc::ServerContextBase& context,
                                       const TokenTable* known) const;
  absl::Status LoadTokens(const std::string& path);
  [[nodiscard]] std::shared_ptr<const TokenTable> tokens() const;

  std::unique_ptr<ReloadedTls> tls_;
  bool trusts_certificates_ = false;
  mutable std::mutex mutex_;
  std::shared_ptr<const TokenTable> tokens_;
  // Last: they write to the members above.
  std::unique_ptr<FileWatch> tls_watch_;
  std::unique_ptr<FileWatch> token_watch_;
};

// InvalidArgument where others than this machine could connect and calls would not be both
// encrypted and authenticated; with insecure_listen it is only logged.
absl::Status CheckReach(const std::vector<ListeningSocket>& sockets, const Access& access,
                        bool insecure_listen);

}  // namespace halflight
