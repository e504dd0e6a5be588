// Declares the flags of each command and writes what they say into the options.
// Leaves out what the options then mean (request_builder.h).
#pragma once

#include "client/cli/options.h"

namespace CLI {
class App;
}  // namespace CLI

namespace halflight::client {

// `options` must outlive the parsing.
void AddRenderFlags(CLI::App& app, RenderOptions& options);
void AddInfoFlags(CLI::App& app, InfoOptions& options);

}  // namespace halflight::client
