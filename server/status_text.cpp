#include "server/status_text.h"

#include "absl/strings/cord.h"

namespace halflight {
namespace {

absl::Status WithPayloadsOf(const absl::Status& from, absl::Status to) {
  from.ForEachPayload(
      [&to](absl::string_view name, const absl::Cord& payload) { to.SetPayload(name, payload); });
  return to;
}

}  // namespace

std::string MessageOf(const absl::Status& status) {
  return {status.message().data(), status.message().size()};
}

absl::Status Prefixed(const std::string& prefix, const absl::Status& status) {
  return WithPayloadsOf(status, {status.code(), prefix + MessageOf(status)});
}

absl::Status WithCode(absl::StatusCode code, const absl::Status& status) {
  return WithPayloadsOf(status, {code, status.message()});
}

}  // namespace halflight
