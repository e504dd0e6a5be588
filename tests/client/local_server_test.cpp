// Starting a server of one's own, with small scripts in the server's place; the real one is started
// by the tests in loopback/.
#include "client/local_server.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <csignal>
#include <thread>

#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

namespace fs = std::filesystem;
using absl::StatusCode;

class LocalServerTest : public testing::Test {
 protected:
  // The script writes its arguments and process id into files of the directory first.
  LocalServerOptions Script(const std::string& body) {
    LocalServerOptions options;
    options.executable =
        directory_.Write("server.sh", "#!/bin/sh\necho \"$@\" > " + (directory_ / "arguments") +
                                          "\necho $$ > " + (directory_ / "pid") + "\n" + body);
    chmod(options.executable.c_str(), 0700);
    options.start_timeout = std::chrono::milliseconds(300);
    return options;
  }
  [[nodiscard]] std::string Read(const std::string& name) const {
    std::ifstream file(directory_ / name);
    std::string line;
    std::getline(file, line);
    return line;
  }

  TestDirectory directory_;
};

TEST_F(LocalServerTest, TellsWhatAServerLoggedThatEnded) {
  const auto options = Script("echo no device >&2\nexit 3\n");
  ExpectError(LocalServer::Start(options).status(), StatusCode::kUnavailable,
              {options.executable, "exit code 3", "no device"});
}

TEST_F(LocalServerTest, GivesUpOnAServerThatNeverAnswersAndEndsIt) {
  auto options = Script("exec sleep 100\n");
  options.device = "gpu0";
  ExpectError(LocalServer::Start(options).status(), StatusCode::kUnavailable,
              {"did not answer within 300 ms", "logged: nothing"});
  EXPECT_NE(kill(std::stoi(Read("pid")), 0), 0);
  // "--address unix:DIRECTORY/socket ...": the directory is gone with the server.
  const std::string arguments = Read("arguments");
  EXPECT_THAT(arguments, testing::StartsWith("--address unix:/"));
  EXPECT_THAT(arguments, testing::EndsWith("/socket --log-level warn --device gpu0"));
  const size_t start = arguments.find('/');
  EXPECT_FALSE(fs::exists(arguments.substr(start, arguments.find("/socket") - start)));
}

TEST_F(LocalServerTest, KeepsItsSocketToItself) {
  const auto options = Script("d=${2#unix:}\nstat -c %a \"${d%/socket}\" >&2\nexit 1\n");
  ExpectError(LocalServer::Start(options).status(), StatusCode::kUnavailable, {"logged:\n700"});
}

TEST_F(LocalServerTest, KeepsOnlyTheEndOfALongLog) {
  const auto options = Script("yes start | head -c 100000 >&2\necho the end >&2\nexit 1\n");
  const auto status = LocalServer::Start(options).status();
  EXPECT_LT(status.message().size(), 5000U);
  ExpectError(status, StatusCode::kUnavailable, {"the end"});
}

TEST_F(LocalServerTest, NamesAnExecutableThatIsNotThere) {
  LocalServerOptions options;
  options.executable = directory_ / "nothing";
  ExpectError(LocalServer::Start(options).status(), StatusCode::kUnavailable,
              {"nothing", "cannot be executed"});
}

TEST_F(LocalServerTest, StopsWaitingWhenStopped) {
  auto options = Script("exec sleep 100\n");
  options.start_timeout = std::chrono::seconds(60);
  std::stop_source stop;
  options.stop = stop.get_token();
  const std::jthread stopper([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stop.request_stop();
  });
  EXPECT_EQ(LocalServer::Start(options).status().code(), StatusCode::kCancelled);
  EXPECT_NE(kill(std::stoi(Read("pid")), 0), 0);
}

}  // namespace
}  // namespace halflight::client
