#include "server/handlers/find_missing_particles.h"

#include <fmt/format.h>

#include "halflight/sha256.h"
#include "server/convert/field_checks.h"

namespace halflight {
namespace {

constexpr int kMaxNames = 1024;

}  // namespace

absl::StatusOr<v1::FindMissingParticlesResponse> FindMissingParticles(
    const Backend& backend, const v1::FindMissingParticlesRequest& request) {
  if (request.sha256_size() > kMaxNames) {
    return FieldError("sha256", fmt::format("{} names", request.sha256_size()),
                      fmt::format("at most {}", kMaxNames));
  }
  v1::FindMissingParticlesResponse response;
  for (int i = 0; i < request.sha256_size(); ++i) {
    const std::string& sha256 = request.sha256(i);
    if (sha256.size() != kSha256Bytes) {
      return FieldError(fmt::format("sha256[{}]", i), fmt::format("{} bytes", sha256.size()),
                        fmt::format("{} bytes", kSha256Bytes));
    }
    if (!backend.store.Touch(sha256)) {
      response.add_missing_sha256(sha256);
    }
  }
  const auto missing = static_cast<size_t>(response.missing_sha256_size());
  backend.metrics.OnSetsAsked(static_cast<size_t>(request.sha256_size()) - missing, missing);
  return response;
}

}  // namespace halflight
