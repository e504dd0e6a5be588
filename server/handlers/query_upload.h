// QueryUpload: how much of a set a client may leave out of its upload.
#pragma once

#include "absl/status/statusor.h"
#include "halflight/v1/particles.pb.h"
#include "server/caller.h"
#include "server/handlers/backend.h"

namespace halflight {

// InvalidArgument for a name that is not 32 bytes. A set that is held counts as used.
absl::StatusOr<v1::QueryUploadResponse> QueryUpload(const Backend& backend,
                                                    const v1::QueryUploadRequest& request,
                                                    const Caller& caller = {});

}  // namespace halflight
