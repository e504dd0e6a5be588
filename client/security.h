// How a client and its server know each other: encryption, certificates, tokens. Files are read
// here, once, when the client connects.
#pragma once

#include <memory>
#include <string>

#include <grpcpp/security/credentials.h>

#include "absl/status/statusor.h"
#include "client/client.h"

namespace halflight::client {

// What a channel to `address` is made with. InvalidArgument "<field>: ..." where a file cannot be
// read, a certificate comes without its key, or the token would travel in plain text beyond this
// machine.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeCredentials(
    const std::string& address, const Security& security);

// The token that a file holds: its first word. InvalidArgument where there is none.
absl::StatusOr<std::string> ReadTokenFile(const std::string& path);

}  // namespace halflight::client
