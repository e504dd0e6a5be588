// halflightd as a process, its engine faked: how it starts, refuses to start, drains and stops.

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "halflight/v1/service.grpc.pb.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using ::testing::HasSubstr;
using testing::MakeRequest;
using testing::WaitFor;

namespace fs = std::filesystem;

class Process {
 public:
  Process(std::vector<std::string> arguments, std::string log) : log_(std::move(log)) {
    arguments.insert(arguments.begin(), std::string(HALFLIGHT_BINARY_DIR) + "/halflightd_fake");
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) {
      argv.push_back(argument.data());
    }
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      const int fd = open(log_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
      dup2(fd, STDERR_FILENO);
      dup2(fd, STDOUT_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
  }
  ~Process() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  Process(Process&&) = delete;
  Process& operator=(Process&&) = delete;

  void Signal(int signal) const { kill(pid_, signal); }

  // The exit code; -1 when it does not end within 10 s, or of a signal.
  int Wait() {
    int status = 0;
    const bool ended = WaitFor([&] { return waitpid(pid_, &status, WNOHANG) == pid_; });
    if (ended) {
      pid_ = -1;
    }
    return ended && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  [[nodiscard]] std::string Log() const {
    std::ostringstream text;
    text << std::ifstream(log_).rdbuf();
    return text.str();
  }

  // The address in the line that says it is ready.
  [[nodiscard]] std::string Address() const {
    const std::string key = "listening address=";
    std::string address;
    EXPECT_TRUE(WaitFor([&] {
      const std::string log = Log();
      const size_t at = log.find(key);
      const size_t end = at == std::string::npos ? at : log.find('\n', at);
      if (end == std::string::npos) {
        return false;
      }
      address = log.substr(at + key.size(), end - at - key.size());
      return true;
    })) << Log();
    return address;
  }

 private:
  std::string log_;
  pid_t pid_ = -1;
};

class Daemon : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string Path(const std::string& name) const { return folder_ + "/" + name; }

  static std::unique_ptr<v1::RenderService::Stub> Connect(const std::string& address) {
    return v1::RenderService::NewStub(
        grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  }

  static grpc::Status Render(v1::RenderService::Stub& stub) {
    grpc::ClientContext context;
    auto reader = stub.RenderFrame(&context, MakeRequest());
    v1::RenderFrameResponse response;
    while (reader->Read(&response)) {
    }
    return reader->Finish();
  }

  const std::string folder_ = ::testing::TempDir() + "halflightd." + std::to_string(getpid());
};

TEST_F(Daemon, FinishesWhatRunsOnSigtermAndExitsWell) {
  std::ofstream(Path("hold")) << "";
  Process server({"--address", "127.0.0.1:0", "--device", Path("hold")}, Path("log"));
  const auto stub = Connect(server.Address());
  grpc::Status status;
  std::jthread client([&] { status = Render(*stub); });
  // The frame is under way: nothing tells so from outside but a little time.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  server.Signal(SIGTERM);
  ASSERT_TRUE(WaitFor([&] { return server.Log().find("draining") != std::string::npos; }));
  EXPECT_EQ(Render(*stub).error_code(), grpc::StatusCode::UNAVAILABLE);
  fs::remove(Path("hold"));
  client.join();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(server.Wait(), 0) << server.Log();
  EXPECT_THAT(server.Log(), HasSubstr("outcome=OK"));
}

TEST_F(Daemon, SecondSignalEndsItAtOnce) {
  std::ofstream(Path("hold")) << "";
  Process server({"--address", "unix:" + Path("socket"), "--device", Path("hold")}, Path("log"));
  const auto stub = Connect(server.Address());
  std::jthread client([&] { EXPECT_FALSE(Render(*stub).ok()); });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  server.Signal(SIGTERM);
  ASSERT_TRUE(WaitFor([&] { return server.Log().find("draining") != std::string::npos; }));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 3);
  EXPECT_THAT(server.Log(), HasSubstr("stopped before"));
  EXPECT_FALSE(fs::exists(Path("socket")));
}

TEST_F(Daemon, TimeToDrainIsBounded) {
  std::ofstream(Path("hold")) << "";
  Process server({"--address", "127.0.0.1:0", "--device", Path("hold"), "--drain-seconds", "1"},
                 Path("log"));
  const auto stub = Connect(server.Address());
  std::jthread client([&] { EXPECT_FALSE(Render(*stub).ok()); });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  server.Signal(SIGINT);
  EXPECT_EQ(server.Wait(), 3);
}

TEST_F(Daemon, SocketFileComesAndGoesWithIt) {
  // Left over from a server that was killed.
  const int stale = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  Path("socket").copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(stale, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  close(stale);

  Process server({"--address", "unix:" + Path("socket")}, Path("log"));
  EXPECT_EQ(server.Address(), "unix:" + Path("socket"));
  EXPECT_TRUE(Render(*Connect(server.Address())).ok());

  Process second({"--address", "unix:" + Path("socket")}, Path("second"));
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(second.Log(), HasSubstr("another server listens on " + Path("socket")));
  EXPECT_TRUE(Render(*Connect(server.Address())).ok()) << "the second server took the socket";

  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
  EXPECT_FALSE(fs::exists(Path("socket")));
}

TEST_F(Daemon, PortInUseIsAClearError) {
  Process server({"--address", "127.0.0.1:0"}, Path("log"));
  Process second({"--address", server.Address()}, Path("second"));
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(second.Log(), HasSubstr("--address " + server.Address() + ": cannot listen there"));
}

TEST_F(Daemon, FileThatIsNoSocketIsLeftAlone) {
  std::ofstream(Path("notes")) << "precious";
  Process server({"--address", "unix:" + Path("notes")}, Path("log"));
  EXPECT_EQ(server.Wait(), 1);
  EXPECT_THAT(server.Log(), HasSubstr("is not a socket"));
  EXPECT_EQ(fs::file_size(Path("notes")), 8U);
}

TEST_F(Daemon, BadFlagsAndDevicesHaveTheirOwnExitCodes) {
  Process flags({"--address", "nowhere"}, Path("flags"));
  EXPECT_EQ(flags.Wait(), 2);
  EXPECT_THAT(flags.Log(), HasSubstr("--address: nowhere"));
  Process device({"--device", "missing"}, Path("device"));
  EXPECT_EQ(device.Wait(), 1);
  EXPECT_THAT(device.Log(), HasSubstr("--device: missing"));
  Process version({"--version"}, Path("version"));
  EXPECT_EQ(version.Wait(), 0);
  EXPECT_THAT(version.Log(), HasSubstr("halflightd 0."));
}

}  // namespace
}  // namespace halflight
