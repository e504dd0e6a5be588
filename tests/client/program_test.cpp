// The program halflight as a shell sees it: what it says of a command line that it does not
// understand, and what it does when nobody takes its words. Needs no server.
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <optional>
#include <string>

#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

struct Ended {
  int exit_code;
  std::string text;  // what reached the pipe
};

// Runs the program with these words and redirections.
Ended Shell(const std::string& words) {
  FILE* const pipe = popen((HALFLIGHT_BINARY_DIR "/halflight " + words).c_str(), "r");
  Ended ended{-1, ""};
  std::array<char, 4096> bytes{};
  while (const size_t count = fread(bytes.data(), 1, bytes.size(), pipe)) {
    ended.text.append(bytes.data(), count);
  }
  ended.exit_code = WEXITSTATUS(pclose(pipe));
  return ended;
}

TEST(Program, NamesWhatItDoesNotKnow) {
  struct Case {
    const char* words;
    const char* text;
  };
  for (const Case& bad : {
           Case{"", "command: none is given; allowed: render, info"},
           Case{"rendr a.ply", "command: is 'rendr'; allowed: render, info"},
           Case{"render a.ply --ouput b.png", "--ouput: is no flag"},
           Case{"render a.ply b.ply -o c.png", "input: 'b.ply' is one too many"},
       }) {
    const Ended ended = Shell(std::string(bad.words) + " 2>&1");
    EXPECT_EQ(ended.exit_code, static_cast<int>(ExitCode::kUsage)) << bad.words;
    EXPECT_THAT(ended.text, HasSubstr(bad.text));
  }
}

TEST(Program, ReportsWrongFlagsAsJsonTooWhereverTheFlagStands) {
  for (const char* words : {"render --json --size 0", "render --size 0 --json"}) {
    const Ended ended = Shell(std::string(words) + " 2>/dev/null");
    EXPECT_THAT(ended.text, StartsWith("{\"error\":\"--size: is '0'"));
    EXPECT_THAT(ended.text, HasSubstr("\"exit_code\":2"));
  }
}

TEST(Program, FailsWhereItsReportIsLost) {
  const TestDirectory directory;
  const std::string scene =
      "render --print-scene " + directory.Write("a.csv", "x,y,z\n0,0,0\n1,1,1\n");
  const Ended full = Shell(scene + " 2>&1 >/dev/full");
  EXPECT_EQ(full.exit_code, static_cast<int>(ExitCode::kOutput));
  EXPECT_THAT(full.text, HasSubstr("stdout: cannot be written"));
  // Closed on purpose: nothing is missing.
  const Ended closed = Shell(scene + " 2>&1 >&-");
  EXPECT_EQ(closed.exit_code, 0);
  EXPECT_THAT(closed.text, IsEmpty());
}

// As under nohup, and behind the & of a shell.
TEST(InterruptWatch, LeavesSignalsAloneThatAreIgnored) {
  for (const int signal : {SIGINT, SIGHUP}) {
    auto* const before = std::signal(signal, SIG_IGN);
    std::optional<InterruptWatch> watch(std::in_place);
    const std::stop_token stop = watch->stop();
    kill(getpid(), signal);
    sigset_t pending;
    do {
      sigpending(&pending);
    } while (sigismember(&pending, signal) == 1);
    watch.reset();  // its thread has heeded by then whatever it took
    EXPECT_FALSE(stop.stop_requested());
    std::signal(signal, before);
  }
}

}  // namespace
}  // namespace halflight::client
