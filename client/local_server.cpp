#include "client/local_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/status_text.h"

namespace halflight::client {

namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr size_t kLogTailBytes = 4096;
// A socket's path may have 107 bytes; the directory's name and the socket's take 40 at most.
constexpr size_t kLongestTmpDir = 64;

absl::StatusOr<std::string> FindExecutable() {
  constexpr const char* kName = "halflightd";
  std::error_code error;
  const fs::path beside = fs::read_symlink("/proc/self/exe", error).parent_path() / kName;
  if (!error && access(beside.c_str(), X_OK) == 0) {
    return beside.string();
  }
  const char* const path = std::getenv("PATH");
  std::istringstream directories(path == nullptr ? "" : path);
  for (std::string directory; std::getline(directories, directory, ':');) {
    const fs::path candidate = fs::path(directory) / kName;
    if (!directory.empty() && access(candidate.c_str(), X_OK) == 0) {
      return candidate.string();
    }
  }
  return absl::NotFoundError(
      fmt::format("no {} in {} or in PATH: install it there, or name a running server", kName,
                  beside.parent_path().string()));
}

absl::StatusOr<std::string> MakePrivateDirectory() {
  const char* tmp = std::getenv("TMPDIR");
  if (tmp == nullptr || *tmp == '\0' || std::strlen(tmp) > kLongestTmpDir) {
    tmp = "/tmp";
  }
  std::string directory = fmt::format("{}/halflight-XXXXXX", tmp);
  if (mkdtemp(directory.data()) == nullptr) {
    return absl::UnavailableError(
        fmt::format("{}: cannot make a directory: {}", directory, std::strerror(errno)));
  }
  return directory;
}

// What the child does between fork and exec: only what is safe there.
[[noreturn]] void BecomeServer(const std::vector<char*>& arguments, int log_fd, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) {
    _exit(127);  // the parent ended before the line above
  }
  // Ctrl-C in a terminal is for the client, which then ends the server in order.
  setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const int null_fd = open("/dev/null", O_RDWR);
  dup2(null_fd, STDIN_FILENO);
  dup2(log_fd, STDOUT_FILENO);
  dup2(log_fd, STDERR_FILENO);
  execv(arguments[0], arguments.data());
  constexpr char kMessage[] = "cannot be executed\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, kMessage, sizeof(kMessage) - 1);
  _exit(127);
}

}  // namespace

class LocalServer::Process {
 public:
  explicit Process(std::string directory)
      : directory_(std::move(directory)), address_("unix:" + directory_ + "/socket") {}
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  ~Process() {
    End();
    if (log_reader_.joinable()) {
      log_reader_.join();
    }
    std::error_code ignored;
    fs::remove_all(directory_, ignored);
  }

  absl::Status Spawn(const std::string& executable, const LocalServerOptions& options) {
    std::vector<std::string> words = {executable, "--address", address_, "--log-level",
                                      options.log_level};
    if (!options.device.empty()) {
      words.insert(words.end(), {"--device", options.device});
    }
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (std::string& word : words) {
      arguments.push_back(word.data());
    }
    arguments.push_back(nullptr);

    std::array<int, 2> log{};
    if (pipe2(log.data(), O_CLOEXEC) != 0) {
      return absl::UnavailableError(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
    }
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ == 0) {
      BecomeServer(arguments, log[1], parent);
    }
    close(log[1]);
    if (pid_ < 0) {
      close(log[0]);
      return absl::UnavailableError(
          fmt::format("cannot start a process: {}", std::strerror(errno)));
    }
    log_reader_ = std::thread([this, fd = log[0]] { ReadLog(fd); });
    return absl::OkStatus();
  }

  // Whether the server still runs; afterwards what() says how it ended.
  bool IsRunning() {
    int status = 0;
    if (pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = -1;
      end_ = WIFSIGNALED(status) ? fmt::format("was ended by signal {}", WTERMSIG(status))
                                 : fmt::format("ended with exit code {}", WEXITSTATUS(status));
    }
    return pid_ > 0;
  }

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] const std::string& how_it_ended() const { return end_; }
  [[nodiscard]] std::string LogTail() const {
    const std::lock_guard lock(mutex_);
    return log_tail_;
  }

 private:
  void End() {
    if (!IsRunning()) {
      return;
    }
    kill(pid_, SIGTERM);
    constexpr milliseconds kPoll{10};
    for (milliseconds waited{0}; waited < milliseconds(5000) && IsRunning(); waited += kPoll) {
      std::this_thread::sleep_for(kPoll);
    }
    if (IsRunning()) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
      pid_ = -1;
    }
  }

  void ReadLog(int fd) {
    std::array<char, 1024> buffer;
    for (ssize_t got = 0; (got = read(fd, buffer.data(), buffer.size())) != 0;) {
      if (got < 0 && errno == EINTR) {
        continue;
      }
      if (got < 0) {
        break;
      }
      const std::lock_guard lock(mutex_);
      log_tail_.append(buffer.data(), static_cast<size_t>(got));
      if (log_tail_.size() > kLogTailBytes) {
        log_tail_.erase(0, log_tail_.size() - kLogTailBytes);
      }
    }
    close(fd);
  }

  std::string directory_;
  std::string address_;
  std::string end_;
  pid_t pid_ = -1;
  std::thread log_reader_;
  mutable std::mutex mutex_;
  std::string log_tail_;
};

LocalServer::LocalServer(std::unique_ptr<Process> process) : process_(std::move(process)) {}
LocalServer::LocalServer(LocalServer&&) noexcept = default;
LocalServer& LocalServer::operator=(LocalServer&&) noexcept = default;
LocalServer::~LocalServer() = default;

const std::string& LocalServer::address() const { return process_->address(); }
std::string LocalServer::LogTail() const { return process_->LogTail(); }

absl::StatusOr<LocalServer> LocalServer::Start(const LocalServerOptions& options) {
  absl::StatusOr<std::string> executable = options.executable;
  if (options.executable.empty()) {
    executable = FindExecutable();
  }
  if (!executable.ok()) {
    return executable.status();
  }
  const auto directory = MakePrivateDirectory();
  if (!directory.ok()) {
    return directory.status();
  }
  auto process = std::make_unique<Process>(*directory);
  if (absl::Status status = process->Spawn(*executable, options); !status.ok()) {
    return status;
  }

  // Ask until it answers; a server that has ended never will.
  ClientOptions client_options;
  client_options.timeout = milliseconds(2000);
  client_options.max_attempts = 1;
  client_options.stop = options.stop;
  auto client = Client::Connect(process->address(), client_options);
  if (!client.ok()) {
    return client.status();
  }
  const auto deadline = std::chrono::steady_clock::now() + options.start_timeout;
  std::string reason;
  while (process->IsRunning()) {
    absl::Status status = absl::UnavailableError("it does not listen");
    if (client->WaitForConnection(milliseconds(50))) {
      status = client->GetServerInfo().status();
    }
    if (status.ok()) {
      return LocalServer(std::move(process));
    }
    if (options.stop.stop_requested()) {
      return absl::CancelledError("interrupted");
    }
    if (std::chrono::steady_clock::now() > deadline) {
      reason = fmt::format("did not answer within {} ms: {}", options.start_timeout.count(),
                           MessageOf(status));
      break;
    }
  }
  if (reason.empty()) {
    reason = process->how_it_ended();
    std::this_thread::sleep_for(milliseconds(50));  // its last lines are on their way
  }
  const std::string log = process->LogTail();
  return absl::UnavailableError(fmt::format("{} {}; it logged:{}{}", *executable, reason,
                                            log.empty() ? " nothing" : "\n", log));
}

}  // namespace halflight::client
