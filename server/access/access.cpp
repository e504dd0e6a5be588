#include "server/access/access.h"

#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/auth_context.h>

#include "absl/strings/match.h"
#include "server/log/log.h"
#include "server/status_text.h"

namespace halflight {
namespace {

constexpr absl::string_view kScheme = "Bearer ";

absl::Status Unauthenticated(const char* why) {
  return absl::UnauthenticatedError(fmt::format(
      "authorization: {}, allowed: \"Bearer \" and a token that this server knows, or none with a "
      "client certificate of an authority that it trusts",
      why));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Access>> Access::Load(const AccessOptions& options) {
  auto access = std::make_unique<Access>();
  if (!options.tls.certificate.empty()) {
    auto watch = std::make_unique<FileWatch>(std::vector<std::string>{
        options.tls.certificate, options.tls.key, options.tls.client_authorities});
    auto files = LoadTlsFiles(options.tls);
    if (!files.ok()) {
      return Prefixed("--tls-cert, --tls-key, --tls-client-ca: ", files.status());
    }
    access->tls_ = std::make_unique<ReloadedTls>(*std::move(files));
    access->trusts_certificates_ = !options.tls.client_authorities.empty();
    watch->Start([tls = access->tls_.get(), paths = options.tls]() -> absl::Status {
      auto fresh = LoadTlsFiles(paths);
      if (!fresh.ok()) {
        return fresh.status();
      }
      tls->Replace(*std::move(fresh));
      return absl::OkStatus();
    });
    access->tls_watch_ = std::move(watch);
  }
  if (!options.token_file.empty()) {
    auto watch = std::make_unique<FileWatch>(std::vector<std::string>{options.token_file});
    if (absl::Status status = access->LoadTokens(options.token_file); !status.ok()) {
      return Prefixed("--token-file: ", status);
    }
    watch->Start(
        [self = access.get(), path = options.token_file] { return self->LoadTokens(path); });
    access->token_watch_ = std::move(watch);
  }
  return access;
}

absl::Status Access::LoadTokens(const std::string& path) {
  const auto text = ReadSmallFile(path);
  if (!text.ok()) {
    return text.status();
  }
  auto table = TokenTable::Parse(*text);
  if (!table.ok()) {
    return Prefixed(path + ": ", table.status());
  }
  const std::lock_guard lock(mutex_);
  tokens_ = std::make_shared<const TokenTable>(*std::move(table));
  return absl::OkStatus();
}

std::shared_ptr<const TokenTable> Access::tokens() const {
  const std::lock_guard lock(mutex_);
  return tokens_;
}

std::shared_ptr<grpc::ServerCredentials> Access::Credentials() const {
  return encrypts() ? tls_->Credentials() : grpc::InsecureServerCredentials();
}

absl::StatusOr<std::string> Access::TenantOf(const grpc::ServerContextBase& context) const {
  const std::shared_ptr<const TokenTable> known = tokens();
  if (known == nullptr && !trusts_certificates_) {
    return "";
  }
  return TenantOf(context, known.get());
}

absl::StatusOr<std::string> Access::TenantOf(const grpc::ServerContextBase& context,
                                             const TokenTable* known) const {
  const auto [begin, end] = context.client_metadata().equal_range("authorization");
  if (begin != end) {
    if (known == nullptr) {
      return Unauthenticated("no tokens are known here");
    }
    const absl::string_view value(begin->second.data(), begin->second.size());
    if (std::next(begin) != end || !absl::StartsWithIgnoreCase(value, kScheme)) {
      return Unauthenticated("is not one bearer token");
    }
    const absl::string_view token = value.substr(kScheme.size());
    if (auto tenant = known->TenantOf({token.data(), token.size()})) {
      return *std::move(tenant);
    }
    return Unauthenticated("the token is not known");
  }
  const std::shared_ptr<const grpc::AuthContext> peer = context.auth_context();
  if (!trusts_certificates_ || !peer->IsPeerAuthenticated()) {
    return Unauthenticated("is missing");
  }
  for (const char* property :
       {GRPC_PEER_URI_PROPERTY_NAME, GRPC_PEER_DNS_PROPERTY_NAME, GRPC_X509_CN_PROPERTY_NAME}) {
    const auto names = peer->FindPropertyValues(property);
    if (names.empty()) {
      continue;
    }
    const std::string name(names.front().data(), names.front().size());
    if (!IsTenantName(name)) {
      return Unauthenticated("the certificate's name is not 1 to 128 printable characters");
    }
    return name;
  }
  return Unauthenticated("the certificate has no name");
}

absl::Status CheckReach(const std::vector<ListeningSocket>& sockets, const Access& access,
                        bool insecure_listen) {
  if (access.encrypts() && access.authenticates()) {
    return absl::OkStatus();
  }
  const char* const lacks =
      access.encrypts()        ? "whoever they are (no --token-file or --tls-client-ca)"
      : access.authenticates() ? "and read tokens and pictures on the way (no --tls-cert)"
                               : "whoever they are, and read everything on the way (no --tls-cert, "
                                 "no --token-file or --tls-client-ca)";
  for (const ListeningSocket& socket : sockets) {
    if (socket.local()) {
      continue;
    }
    if (!insecure_listen) {
      return absl::InvalidArgumentError(
          fmt::format("--address: {}: others than this machine could call, {}; allowed: loopback "
                      "addresses and unix sockets, or all with --insecure-listen",
                      socket.address(), lacks));
    }
    Log(LogLevel::kWarn, "insecure",
        {{"address", socket.address()},
         {"message", fmt::format("others than this machine can call, {}", lacks)}});
  }
  return absl::OkStatus();
}

}  // namespace halflight
