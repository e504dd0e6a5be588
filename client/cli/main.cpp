// halflight, the command-line client: flags, one command, an exit code.
// What each command does is in its own pair of files.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <string>

#include "client/cli/exit_code.h"
#include "client/cli/flags.h"
#include "client/cli/info_command.h"
#include "client/cli/interrupt.h"
#include "client/cli/json.h"
#include "client/cli/render_command.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

ExitCode Run(int argc, char** argv) {
  CLI::App app("Renders particle clouds with shadows, through a halflight server.", "halflight");
  app.set_version_flag("--version", "halflight " HALFLIGHT_VERSION);
  app.require_subcommand(1);
  app.footer(kExitCodesHelp);

  RenderOptions render_options;
  CLI::App* const render = app.add_subcommand(
      "render", "Render particle files: halflight render plume.0040.ply -o frame.png");
  AddRenderFlags(*render, render_options);
  render->footer(kExitCodesHelp);

  InfoOptions info_options;
  CLI::App* const info = app.add_subcommand("info", "Say what the server is and can do");
  AddInfoFlags(*info, info_options);
  info->footer(kExitCodesHelp);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? ExitCode::kOk : ExitCode::kUsage;  // 0: --help, --version
  }

  const InterruptWatch interrupt;
  const absl::Status status = render->parsed() ? RunRender(render_options, interrupt.stop())
                                               : RunInfo(info_options, interrupt.stop());
  const bool json = render_options.json || info_options.json;
  if (!status.ok() && json) {
    JsonObject error;
    error.Add("error", MessageOf(status));
    error.AddNumber("exit_code", static_cast<int>(ExitCodeOf(status)));
    fmt::print("{}\n", error.Text());
  }
  if (!status.ok()) {
    fmt::print(stderr, "halflight: {}\n", MessageOf(status));
  }
  return ExitCodeOf(status);
}

}  // namespace

}  // namespace halflight::client

int main(int argc, char** argv) {
  try {
    return static_cast<int>(halflight::client::Run(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "halflight: {}\n", error.what());
    return static_cast<int>(halflight::client::ExitCode::kFailed);
  }
}
