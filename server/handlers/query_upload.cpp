#include "server/handlers/query_upload.h"

#include <fmt/format.h>

#include "halflight/sha256.h"
#include "server/convert/field_checks.h"

namespace halflight {

absl::StatusOr<v1::QueryUploadResponse> QueryUpload(const Backend& backend,
                                                    const v1::QueryUploadRequest& request,
                                                    const Caller& caller) {
  const std::string& sha256 = request.sha256();
  if (sha256.size() != kSha256Bytes) {
    return FieldError("sha256", fmt::format("{} bytes", sha256.size()),
                      fmt::format("{} bytes", kSha256Bytes));
  }
  v1::QueryUploadResponse response;
  if (backend.store.Touch(sha256)) {
    backend.metrics.OnSetsAsked(1, 0);
    response.set_complete(true);
  } else {
    backend.metrics.OnSetsAsked(0, 1);
    response.set_committed_bytes(backend.partial_uploads.CommittedBytes(sha256, caller.tenant));
  }
  return response;
}

}  // namespace halflight
