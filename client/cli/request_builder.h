// Turns flags into the request, on top of what a scene file said (request_json.h).
// Leaves out what depends on the particles (scene_defaults.h) and every check that the server
// makes.
#pragma once

#include "absl/status/status.h"
#include "client/cli/options.h"
#include "halflight/v1/service.pb.h"

namespace halflight::client {

// Puts the flags that were given into `request`. A light along the view gets no direction yet.
// InvalidArgument where flags do not go together, or an output's extension is unknown.
absl::Status ApplyFlags(const RenderOptions& options, v1::RenderFrameRequest& request);

}  // namespace halflight::client
