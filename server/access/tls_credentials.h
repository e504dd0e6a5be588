// What gRPC secures connections with: certificates that may change while it serves. Where they come
// from stands in tls_files.h.
#pragma once

#include <memory>

#include <grpcpp/security/server_credentials.h>

#include "server/access/tls_files.h"

namespace halflight {

// The newest of something that one thread replaces and others look at.
class TlsMaterial;

// Each new connection is secured by what was last given to Replace; those that are open stay as
// they are. gRPC's own watcher of files is not used: it takes whatever the files hold, and a
// damaged one leaves its server without any certificate.
class ReloadedTls {
 public:
  explicit ReloadedTls(TlsFiles files);
  ~ReloadedTls();
  ReloadedTls(const ReloadedTls&) = delete;
  ReloadedTls& operator=(const ReloadedTls&) = delete;

  // Any thread.
  void Replace(TlsFiles files);

  // A client that shows a certificate must show one of the client authorities'; one that shows none
  // is let in, to be refused by the calls that ask who it is. For one server; this outlives it.
  std::shared_ptr<grpc::ServerCredentials> Credentials();

 private:
  std::unique_ptr<TlsMaterial> material_;
};

}  // namespace halflight
