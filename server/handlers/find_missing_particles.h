// FindMissingParticles: which sets a client has to upload.
#pragma once

#include "absl/status/statusor.h"
#include "halflight/v1/particles.pb.h"
#include "server/handlers/backend.h"

namespace halflight {

// InvalidArgument for a name that is not 32 bytes, or too many names. What is held counts as used.
absl::StatusOr<v1::FindMissingParticlesResponse> FindMissingParticles(
    const Backend& backend, const v1::FindMissingParticlesRequest& request);

}  // namespace halflight
