// halflightd as a process, its engine faked: how it starts, refuses to start, drains and stops.

#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "halflight/v1/service.grpc.pb.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using ::testing::HasSubstr;
using testing::MakeRequest;
using testing::Process;
using testing::WaitFor;

namespace fs = std::filesystem;

class Daemon : public ::testing::Test {
 protected:
  [[nodiscard]] std::string Path(const std::string& name) const { return folder_ / name; }

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

  const testing::Folder folder_;
};

TEST_F(Daemon, LivesOnWhereNobodyReadsItsLogAnyMore) {
  int log[2];
  ASSERT_EQ(pipe2(log, O_CLOEXEC), 0);
  const std::string socket = Path("socket");
  testing::ProcessOptions options;
  options.err = log[1];
  Process server(folder_, "halflightd_fake", {"--address", "unix:" + socket}, options);
  close(log[1]);
  ASSERT_TRUE(WaitFor([&] { return fs::exists(socket); }));
  close(log[0]);
  const auto stub = Connect("unix:" + socket);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(Render(*stub).ok());
  }
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
}

TEST_F(Daemon, FinishesWhatRunsOnSigtermAndExitsWell) {
  std::ofstream(Path("hold")) << "";
  Process server(folder_, "halflightd_fake",
                 {"--address", "127.0.0.1:0", "--device", Path("hold")});
  const auto stub = Connect(server.Address());
  grpc::Status status;
  std::jthread client([&] { status = Render(*stub); });
  // The frame is under way: nothing tells so from outside but a little time.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  server.Signal(SIGTERM);
  ASSERT_TRUE(WaitFor([&] { return server.Err().find("draining") != std::string::npos; }));
  EXPECT_EQ(Render(*stub).error_code(), grpc::StatusCode::UNAVAILABLE);
  fs::remove(Path("hold"));
  client.join();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(server.Wait(), 0) << server.Err();
  EXPECT_THAT(server.Err(), HasSubstr("outcome=OK"));
}

TEST_F(Daemon, SecondSignalEndsItAtOnce) {
  std::ofstream(Path("hold")) << "";
  Process server(folder_, "halflightd_fake",
                 {"--address", "unix:" + Path("socket"), "--device", Path("hold")});
  const auto stub = Connect(server.Address());
  std::jthread client([&] { EXPECT_FALSE(Render(*stub).ok()); });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  server.Signal(SIGTERM);
  ASSERT_TRUE(WaitFor([&] { return server.Err().find("draining") != std::string::npos; }));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 3);
  EXPECT_THAT(server.Err(), HasSubstr("stopped before"));
  EXPECT_FALSE(fs::exists(Path("socket")));
}

TEST_F(Daemon, TimeToDrainIsBounded) {
  std::ofstream(Path("hold")) << "";
  Process server(folder_, "halflightd_fake",
                 {"--address", "127.0.0.1:0", "--device", Path("hold"), "--drain-seconds", "1"});
  const auto stub = Connect(server.Address());
  std::jthread client([&] { EXPECT_FALSE(Render(*stub).ok()); });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto begin = std::chrono::steady_clock::now();
  server.Signal(SIGINT);
  EXPECT_EQ(server.Wait(), 3);
  // Not the default's half a minute.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

TEST_F(Daemon, SignalEndsItWhileTheDeviceHangsAtTheStart) {
  std::ofstream(Path("hold.start")) << "";
  Process server(folder_, "halflightd_fake",
                 {"--address", "127.0.0.1:0", "--device", Path("hold")});
  ASSERT_TRUE(WaitFor([&] { return fs::exists(Path("hold.starting")); }));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0) << server.Err();
}

TEST_F(Daemon, SecondSignalEndsItWhileTheDeviceHangsAtTheEnd) {
  std::ofstream(Path("hold.end")) << "";
  Process server(folder_, "halflightd_fake",
                 {"--address", "127.0.0.1:0", "--device", Path("hold")});
  EXPECT_TRUE(Render(*Connect(server.Address())).ok());
  server.Signal(SIGTERM);
  ASSERT_TRUE(WaitFor([&] { return server.Err().find(" stopped") != std::string::npos; }));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 3);
  EXPECT_THAT(server.Err(), HasSubstr("stopped before all was put away"));
}

TEST_F(Daemon, TimeToPutAwayIsBounded) {
  std::ofstream(Path("hold.end")) << "";
  Process server(folder_, "halflightd_fake",
                 {"--address", "127.0.0.1:0", "--device", Path("hold")});
  ASSERT_NE(server.Address(), "");
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 3);
}

TEST_F(Daemon, SocketFileComesAndGoesWithIt) {
  // Left over from a server that was killed.
  const int stale = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  Path("socket").copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(stale, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  close(stale);

  Process server(folder_, "halflightd_fake", {"--address", "unix:" + Path("socket")});
  EXPECT_EQ(server.Address(), "unix:" + Path("socket"));
  EXPECT_TRUE(Render(*Connect(server.Address())).ok());

  Process second(folder_, "halflightd_fake", {"--address", "unix:" + Path("socket")});
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(second.Err(), HasSubstr("another server listens on " + Path("socket")));
  EXPECT_TRUE(Render(*Connect(server.Address())).ok()) << "the second server took the socket";

  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
  EXPECT_FALSE(fs::exists(Path("socket")));
}

TEST_F(Daemon, PortInUseIsAClearError) {
  Process server(folder_, "halflightd_fake", {"--address", "127.0.0.1:0"});
  Process second(folder_, "halflightd_fake", {"--address", server.Address()});
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(second.Err(), HasSubstr("--address " + server.Address() + ": cannot listen there"));
}

TEST_F(Daemon, FileThatIsNoSocketIsLeftAlone) {
  std::ofstream(Path("notes")) << "precious";
  Process server(folder_, "halflightd_fake", {"--address", "unix:" + Path("notes")});
  EXPECT_EQ(server.Wait(), 1);
  EXPECT_THAT(server.Err(), HasSubstr("is not a socket"));
  EXPECT_EQ(fs::file_size(Path("notes")), 8U);
}

TEST_F(Daemon, BadFlagsAndDevicesHaveTheirOwnExitCodes) {
  Process flags(folder_, "halflightd_fake", {"--address", "nowhere"});
  EXPECT_EQ(flags.Wait(), 2);
  EXPECT_THAT(flags.Err(), HasSubstr("--address: nowhere"));
  Process device(folder_, "halflightd_fake", {"--device", "missing"});
  EXPECT_EQ(device.Wait(), 1);
  EXPECT_THAT(device.Err(), HasSubstr("--device: missing"));
  Process version(folder_, "halflightd_fake", {"--version"});
  EXPECT_EQ(version.Wait(), 0);
  EXPECT_THAT(version.Out(), HasSubstr("halflightd 0."));
}

}  // namespace
}  // namespace halflight
