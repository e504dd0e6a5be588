#include "client/security.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <tuple>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"

namespace halflight::client {

namespace {

absl::StatusOr<std::string> ReadFile(const char* field, const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  if (!file || !(bytes << file.rdbuf())) {
    return absl::InvalidArgumentError(
        fmt::format("{}: '{}' cannot be read: {}; allowed: a file that is not empty", field, path,
                    std::strerror(errno)));
  }
  return bytes.str();
}

// Whether what is said to the address stays on this machine.
bool IsLocal(const std::string& address) {
  const std::string host = address.substr(0, address.rfind(':'));
  return absl::StartsWith(address, "unix:") || host == "localhost" || host == "[::1]" ||
         (absl::StartsWith(host, "127.") &&
          host.find_first_not_of("0123456789.") == std::string::npos);
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeCredentials(
    const std::string& address, const Security& security) {
  if (security.cert_file.empty() != security.key_file.empty()) {
    return absl::InvalidArgumentError(
        fmt::format("{}: is missing; allowed: certificate and key together",
                    security.cert_file.empty() ? "tls-cert" : "tls-key"));
  }
  const bool tls = security.tls || !security.ca_file.empty() || !security.cert_file.empty();
  if (!std::all_of(security.token.begin(), security.token.end(), absl::ascii_isgraph)) {
    return absl::InvalidArgumentError("token: allowed: printable characters without spaces");
  }
  if (!tls && !security.token.empty() && !security.insecure_token && !IsLocal(address)) {
    return absl::InvalidArgumentError(fmt::format(
        "token: would travel to {} in plain text; allowed: with TLS, to this machine, or "
        "with insecure-token",
        address));
  }
  if (!tls) {
    return grpc::InsecureChannelCredentials();
  }
  grpc::SslCredentialsOptions options;
  for (const auto& [field, path, bytes] :
       {std::tuple("tls-ca", &security.ca_file, &options.pem_root_certs),
        std::tuple("tls-cert", &security.cert_file, &options.pem_cert_chain),
        std::tuple("tls-key", &security.key_file, &options.pem_private_key)}) {
    if (path->empty()) {
      continue;
    }
    auto read = ReadFile(field, *path);
    if (!read.ok()) {
      return read.status();
    }
    *bytes = *std::move(read);
  }
  return grpc::SslCredentials(options);
}

absl::StatusOr<std::string> ReadTokenFile(const std::string& path) {
  const auto text = ReadFile("token-file", path);
  if (!text.ok()) {
    return text.status();
  }
  std::string token;
  if (!(std::istringstream(*text) >> token)) {
    return absl::InvalidArgumentError(
        fmt::format("token-file: '{}' holds nothing; allowed: a file with a token", path));
  }
  return token;
}

}  // namespace halflight::client
