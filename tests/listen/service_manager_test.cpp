// Sockets handed over, and the word that the service is ready: the test is the service manager.

#include <chrono>
#include <csignal>
#include <string>
#include <thread>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/listen/listening_socket.h"
#include "tests/listen/client_socket.h"
#include "tests/listen/daemon.h"

namespace halflight {
namespace {

using testing::ClientSocket;
using testing::Folder;
using ::testing::HasSubstr;
using testing::Health;
using testing::kServing;
using testing::NewChannel;
using ::testing::Not;
using testing::Process;

// What a service says to its manager.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& path) : fd_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    path.copy(name.sun_path, sizeof(name.sun_path) - 1);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&name), sizeof(name)), 0);
    const timeval patience{.tv_sec = 60, .tv_usec = 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  }
  ~NotifySocket() { close(fd_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  [[nodiscard]] std::string Next() const {
    char bytes[256];
    const ssize_t got = recv(fd_, bytes, sizeof(bytes), 0);
    return got < 0 ? "nothing" : std::string(bytes, static_cast<size_t>(got));
  }

 private:
  int fd_;
};

class ServiceManager : public ::testing::Test {
 protected:
  ServiceManager() {
    auto bound = ListeningSocket::BindAll({"127.0.0.1:0", "unix:" + folder_ / "socket"});
    EXPECT_TRUE(bound.ok()) << bound.status();
    sockets_ = *std::move(bound);
    EXPECT_TRUE(sockets_[0].Listen().ok());
  }
  [[nodiscard]] std::vector<int> Descriptors() const {
    // Out of the way of the numbers that they get in the child.
    return {fcntl(sockets_[0].fd(), F_DUPFD_CLOEXEC, 100),
            fcntl(sockets_[1].fd(), F_DUPFD_CLOEXEC, 100)};
  }

  const Folder folder_;
  std::vector<ListeningSocket> sockets_;
};

TEST_F(ServiceManager, HandsSocketsOverThatOutliveTheService) {
  Process server(folder_, "halflightd_fake", {}, {.sockets = Descriptors()});
  EXPECT_EQ(server.Address(), sockets_[0].address());
  for (const ListeningSocket& socket : sockets_) {
    EXPECT_EQ(Health(NewChannel(socket.address())), kServing);
    EXPECT_THAT(server.Err(), HasSubstr("listening address=" + socket.address()));
  }
  EXPECT_THAT(server.Err(), Not(HasSubstr(":50551")));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0) << server.Err();
  // Whoever connects meanwhile waits for the next one.
  const ClientSocket early;
  EXPECT_TRUE(early.Connect(sockets_[0].address()));
  Process next(folder_, "halflightd_fake", {}, {.sockets = Descriptors()});
  EXPECT_EQ(Health(NewChannel(sockets_[1].address())), kServing);
}

TEST_F(ServiceManager, AddressesAreListenedOnBesideItsSockets) {
  const Process server(folder_, "halflightd_fake", {"--address", "unix:" + folder_ / "other"},
                       {.sockets = Descriptors()});
  EXPECT_EQ(server.Address(), sockets_[0].address());
  EXPECT_EQ(Health(NewChannel("unix:" + folder_ / "other")), kServing);
}

TEST_F(ServiceManager, SocketsOfAnotherProcessAreNotTaken) {
  const Process server(folder_, "halflightd_fake", {"--address", "127.0.0.1:0"},
                       {.environment = {"LISTEN_FDS=2", "LISTEN_PID=1"}});
  EXPECT_NE(server.Address(), sockets_[0].address());
}

TEST_F(ServiceManager, WhatDoesNotListenIsAnError) {
  Process server(folder_, "halflightd_fake", {}, {.sockets = {STDERR_FILENO}});
  EXPECT_EQ(server.Wait(), 1);
  EXPECT_THAT(server.Err(), HasSubstr("LISTEN_FDS: descriptor 3"));
}

TEST_F(ServiceManager, HearsWhenTheServiceIsReadyAndWhenItStops) {
  const NotifySocket notify(folder_ / "notify");
  Process server(folder_, "halflightd_fake", {"--address", "unix:" + folder_ / "own"},
                 {.environment = {"NOTIFY_SOCKET=" + folder_ / "notify"}});
  EXPECT_EQ(notify.Next(), "READY=1");
  // Ready is when it answers.
  EXPECT_EQ(Health(NewChannel("unix:" + folder_ / "own")), kServing);
  server.Signal(SIGTERM);
  EXPECT_EQ(notify.Next(), "STOPPING=1");
  EXPECT_EQ(server.Wait(), 0);
}

TEST_F(ServiceManager, HearsThatTheServiceLivesWhereItAsks) {
  const NotifySocket notify(folder_ / "notify");
  const Process server(
      folder_, "halflightd_fake", {"--address", "unix:" + folder_ / "own"},
      {.environment = {"NOTIFY_SOCKET=" + folder_ / "notify", "WATCHDOG_USEC=600000"}});
  EXPECT_EQ(notify.Next(), "READY=1");
  for (int beat = 0; beat < 3; ++beat) {
    EXPECT_EQ(notify.Next(), "WATCHDOG=1") << beat;
  }
}

TEST_F(ServiceManager, DoesNotHearItWhereItAsksAnother) {
  const NotifySocket notify(folder_ / "notify");
  Process server(folder_, "halflightd_fake", {"--address", "unix:" + folder_ / "own"},
                 {.environment = {"NOTIFY_SOCKET=" + folder_ / "notify", "WATCHDOG_USEC=1000",
                                  "WATCHDOG_PID=1"}});
  EXPECT_EQ(notify.Next(), "READY=1");
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  server.Signal(SIGTERM);
  EXPECT_EQ(notify.Next(), "STOPPING=1");
  EXPECT_EQ(server.Wait(), 0);
}

}  // namespace
}  // namespace halflight
