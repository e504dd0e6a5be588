// halflight, the command-line client: flags, one command, an exit code.
// What each command does is in its own pair of files.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/exit_code.h"
#include "client/cli/flags.h"
#include "client/cli/info_command.h"
#include "client/cli/interrupt.h"
#include "client/cli/json.h"
#include "client/cli/render_command.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

// What is wrong with the command line, as CLI11 found it; names what it only counts.
std::string UsageMessage(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> extras = app.remaining(true);
  if (extras.empty()) {
    return app.get_subcommands().empty()
               ? "command: none is given; allowed: render, info (halflight render --help)"
               : error.what();
  }
  if (app.get_subcommands().empty()) {
    return fmt::format("command: is '{}'; allowed: render, info", extras.front());
  }
  for (const std::string& word : extras) {
    if (word[0] == '-') {
      return fmt::format("{}: is no flag of this command; allowed: those that --help lists", word);
    }
  }
  return fmt::format("input: '{}' is one too many; allowed: one file, or a pattern with --frames",
                     extras.front());
}

ExitCode Fail(ExitCode code, const std::string& message, bool json) {
  if (json) {
    JsonObject error;
    error.Add("error", message);
    error.AddNumber("exit_code", static_cast<int>(code));
    fmt::print("{}\n", error.Text());
  }
  fmt::print(stderr, "halflight: {}\n", message);
  return code;
}

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
    if (error.get_exit_code() == 0) {  // --help, --version
      app.exit(error);
      return ExitCode::kOk;
    }
    // The flag may stand behind the mistake.
    const bool json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
    return Fail(ExitCode::kUsage, UsageMessage(app, error), json);
  }

  const InterruptWatch interrupt;
  const absl::Status status = render->parsed() ? RunRender(render_options, interrupt.stop())
                                               : RunInfo(info_options, interrupt.stop());
  if (!status.ok()) {
    return Fail(ExitCodeOf(status), MessageOf(status), render_options.json || info_options.json);
  }
  return ExitCode::kOk;
}

// Files and sockets shall not get the numbers of standard streams that were closed: what is printed
// would go into them.
void OpenStandardStreams() {
  int fd = 0;
  do {
    fd = open("/dev/null", O_RDWR);
  } while (fd >= 0 && fd <= STDERR_FILENO);
  close(fd);
}

ExitCode StdoutFailed(const char* reason) {
  fmt::print(stderr, "halflight: stdout: cannot be written: {}\n", reason);
  return ExitCode::kOutput;
}

}  // namespace

}  // namespace halflight::client

int main(int argc, char** argv) {
  using halflight::client::ExitCode;
  halflight::client::OpenStandardStreams();
  // A reader that leaves ends the program through an error, after which nothing is left behind.
  std::signal(SIGPIPE, SIG_IGN);
  ExitCode code = ExitCode::kFailed;
  try {
    code = halflight::client::Run(argc, argv);
    if (std::fflush(stdout) != 0) {
      code = halflight::client::StdoutFailed(std::strerror(errno));
    } else if (std::ferror(stdout) != 0) {
      code = halflight::client::StdoutFailed("it was full or closed while frames were reported");
    }
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0) {
      code = halflight::client::StdoutFailed(error.what());
    } else {
      fmt::print(stderr, "halflight: {}\n", error.what());
    }
  }
  return static_cast<int>(code);
}
