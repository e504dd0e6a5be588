#include "client/cli/request_json.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

namespace halflight::client {

absl::StatusOr<v1::RenderFrameRequest> ParseRequestJson(const std::string& json) {
  v1::RenderFrameRequest request;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &request);
  if (!status.ok()) {
    return absl::InvalidArgumentError(
        fmt::format("is no RenderFrameRequest in protobuf JSON: {}",
                    std::string(status.message().data(), status.message().size())));
  }
  return request;
}

std::string RequestToJson(const v1::RenderFrameRequest& request) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.preserve_proto_field_names = true;
  std::string json;
  // Fails only for messages that hold an Any.
  const auto status = google::protobuf::util::MessageToJsonString(request, &json, options);
  return status.ok() ? json : std::string();
}

}  // namespace halflight::client
