#include "tests/process/process.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/process/wait_for.h"

namespace halflight::testing {

namespace fs = std::filesystem;

Folder::Folder() {
  std::string name = ::testing::TempDir() + "halflight-test-XXXXXX";
  EXPECT_NE(mkdtemp(name.data()), nullptr);
  path_ = name;
  fs::create_directory(path_ + "/tmp");
}

Folder::~Folder() { fs::remove_all(path_); }

std::string Folder::operator/(const std::string& name) const { return path_ + "/" + name; }

std::string Folder::Write(const std::string& name, const std::string& bytes) const {
  std::ofstream(*this / name, std::ios::binary) << bytes;
  return *this / name;
}

Process::Process(const Folder& folder, const std::string& program,
                 std::vector<std::string> arguments, ProcessOptions options) {
  static std::atomic<int> logs = 0;
  log_ = folder / ("log." + std::to_string(logs++));
  arguments.insert(arguments.begin(), std::string(HALFLIGHT_BINARY_DIR) + "/" + program);
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) {
    argv.push_back(argument.data());
  }
  argv.push_back(nullptr);
  options.environment.push_back("TMPDIR=" + folder / "tmp");
  std::array<char, 32> listen_pid{};
  if (!options.sockets.empty()) {
    options.environment.push_back("LISTEN_FDS=" + std::to_string(options.sockets.size()));
  }
  std::vector<char*> environment;
  for (std::string& variable : options.environment) {
    environment.push_back(variable.data());
  }
  if (!options.sockets.empty()) {
    environment.push_back(listen_pid.data());
  }
  environment.push_back(nullptr);
  const std::string out = log_ + ".out";
  const std::string err = log_ + ".err";
  pid_ = fork();
  if (pid_ == 0) {
    constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC;
    dup2(open(out.c_str(), kFlags, 0600), STDOUT_FILENO);
    dup2(options.err >= 0 ? options.err : open(err.c_str(), kFlags, 0600), STDERR_FILENO);
    for (size_t i = 0; i < options.sockets.size(); ++i) {
      dup2(options.sockets[i], static_cast<int>(3 + i));
    }
    std::snprintf(listen_pid.data(), listen_pid.size(), "LISTEN_PID=%d", getpid());
    execve(argv[0], argv.data(), environment.data());
    _exit(127);
  }
}

Process::~Process() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
}

void Process::Signal(int signal) const { kill(pid_, signal); }

int Process::Wait() {
  int status = 0;
  const bool ended = WaitFor([&] { return waitpid(pid_, &status, WNOHANG) == pid_; });
  if (ended) {
    pid_ = -1;
  }
  return ended && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string Process::Out() const { return Contents(log_ + ".out"); }

std::string Process::Err() const { return Contents(log_ + ".err"); }

std::string Process::Address() const {
  const std::string key = "listening address=";
  std::string address;
  EXPECT_TRUE(WaitFor([&] {
    const std::string log = Err();
    const size_t at = log.find(key);
    const size_t end = at == std::string::npos ? at : log.find('\n', at);
    if (end == std::string::npos) {
      return false;
    }
    address = log.substr(at + key.size(), end - at - key.size());
    return true;
  })) << Err();
  return address;
}

bool Process::Logged(const std::string& text) const {
  return Err().find(text) != std::string::npos;
}

size_t Process::Count(const std::string& what) const {
  const fs::directory_iterator entries("/proc/" + std::to_string(pid_) + "/" + what);
  return static_cast<size_t>(std::distance(begin(entries), end(entries)));
}

Ended RunHalflight(const Folder& folder, const std::vector<std::string>& arguments,
                   const ProcessOptions& options) {
  Process process(folder, "halflight", arguments, options);
  const int code = process.Wait();
  return {code, process.Out(), process.Err()};
}

int ProcessesWith(const std::string& text) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string command = Contents(entry.path() / "cmdline");
    count += command.find(text) != std::string::npos ? 1 : 0;
  }
  return count;
}

std::string Contents(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

std::string PlumePath(const std::string& frame) {
  return std::string(HALFLIGHT_TEST_DATA) + "/plume/plume." + frame + ".ply";
}

}  // namespace halflight::testing
