#include "server/status_text.h"

#include "absl/strings/cord.h"

namespace halflight {

std::string MessageOf(const absl::Status& status) {
  return {status.message().data(), status.message().size()};
}

absl::Status Prefixed(const std::string& prefix, const absl::Status& status) {
  absl::Status prefixed(status.code(), prefix + MessageOf(status));
  status.ForEachPayload([&prefixed](absl::string_view name, const absl::Cord& payload) {
    prefixed.SetPayload(name, payload);
  });
  return prefixed;
}

}  // namespace halflight
