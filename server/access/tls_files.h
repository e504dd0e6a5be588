// Certificate, key and authorities of a TLS server, read from files and checked against each other.
// Knows no gRPC.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace halflight {

struct TlsPaths {
  std::string certificate;  // the server's first, then those that lead to an authority
  std::string key;
  std::string client_authorities;  // empty: clients show no certificates
};

// PEM, as in the files.
struct TlsFiles {
  std::string certificate;
  std::string key;
  std::string client_authorities;
};

// InvalidArgument "<path>: <why>" where a file cannot be read, holds nothing of its kind, the key
// is not the certificate's or is locked by a password, the certificate has expired or is not valid
// yet, or TLS does not take it or one of those behind it.
absl::StatusOr<TlsFiles> LoadTlsFiles(const TlsPaths& paths);

// The bytes of a file. InvalidArgument "<path>: <why>"; a file of more than a MiB is none of ours.
absl::StatusOr<std::string> ReadSmallFile(const std::string& path);

}  // namespace halflight
