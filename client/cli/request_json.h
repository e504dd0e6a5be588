// Requests as text: the scene files of --scene and --print-scene.
// Leaves out what flags add to them (request_builder.h).
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "halflight/v1/service.pb.h"

namespace halflight::client {

// A RenderFrameRequest from protobuf JSON. InvalidArgument names what cannot be read.
absl::StatusOr<v1::RenderFrameRequest> ParseRequestJson(const std::string& json);

// For --scene to read; fields named as in the protos.
std::string RequestToJson(const v1::RenderFrameRequest& request);

}  // namespace halflight::client
