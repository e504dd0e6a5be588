// Turns options into the request: the scene file first, then the flags on top of it.
// Leaves out what depends on the particles (scene_defaults.h) and every check that the server
// makes.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/options.h"
#include "halflight/v1/service.pb.h"

namespace halflight::client {

// A RenderFrameRequest from protobuf JSON. InvalidArgument names what cannot be read.
absl::StatusOr<v1::RenderFrameRequest> ParseRequestJson(const std::string& json);
// For --scene to read; fields named as in the protos.
std::string RequestToJson(const v1::RenderFrameRequest& request);

// Puts the flags that were given into `request`. A light along the view gets no direction yet.
// InvalidArgument where flags do not go together, or an output's extension is unknown.
absl::Status ApplyFlags(const RenderOptions& options, v1::RenderFrameRequest& request);

}  // namespace halflight::client
