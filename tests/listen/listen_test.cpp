// Sockets, the loop that accepts, and what it does when there is no room: none of it knows gRPC.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/file_descriptor.h"
#include "server/listen/acceptor.h"
#include "server/listen/connections.h"
#include "server/listen/listening_socket.h"
#include "tests/listen/client_socket.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/sanitizers.h"

namespace halflight {
namespace {

using testing::ClientSocket;
using testing::Folder;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using testing::WaitFor;

// What was accepted, kept open until it is dropped.
class Served {
 public:
  ~Served() { DropAll(); }
  void Take(int fd) {
    const std::lock_guard lock(mutex_);
    fds_.push_back(fd);
  }
  void DropAll() {
    const std::lock_guard lock(mutex_);
    std::for_each(fds_.begin(), fds_.end(), close);
    fds_.clear();
  }
  [[nodiscard]] size_t size() const {
    const std::lock_guard lock(mutex_);
    return fds_.size();
  }
  // Whether the first one's peer seems to be gone within a minute; closes all then.
  bool ReadsTheEnd() {
    pollfd polled{.fd = fds_.front(), .events = POLLIN, .revents = 0};
    char byte = 0;
    const bool end = poll(&polled, 1, 60000) == 1 && recv(polled.fd, &byte, 1, 0) == 0;
    DropAll();
    return end;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<int> fds_;
};

class AcceptorTest : public ::testing::Test {
 protected:
  void Listen(uint32_t max_connections) {
    auto sockets = ListeningSocket::Bind("127.0.0.1:0");
    ASSERT_TRUE(sockets.ok()) << sockets.status();
    address_ = sockets->front().address();
    auto acceptor = Acceptor::Start(*std::move(sockets), connections_,
                                    {.all = max_connections, .one_machine = max_connections},
                                    [this](int fd) { served_.Take(fd); });
    ASSERT_TRUE(acceptor.ok()) << acceptor.status();
    acceptor_ = *std::move(acceptor);
  }
  [[nodiscard]] ClientSocket Connect() const {
    ClientSocket client;
    EXPECT_TRUE(client.Connect(address_));
    return client;
  }

  Served served_;
  std::string address_;
  Connections connections_;
  std::unique_ptr<Acceptor> acceptor_;
};

TEST_F(AcceptorTest, HandsOverSocketsThatDoNotBlockNorStayInChildren) {
  std::atomic<int> accepted = -1;
  auto sockets = ListeningSocket::Bind("127.0.0.1:0");
  ASSERT_TRUE(sockets.ok());
  const std::string address = sockets->front().address();
  const auto acceptor =
      Acceptor::Start(*std::move(sockets), connections_, {.all = 10, .one_machine = 10},
                      [&accepted](int fd) { accepted = fd; });
  ASSERT_TRUE(acceptor.ok());
  ClientSocket client;
  ASSERT_TRUE(client.Connect(address));
  ASSERT_TRUE(WaitFor([&] { return accepted >= 0; }));
  EXPECT_NE(fcntl(accepted, F_GETFL) & O_NONBLOCK, 0);
  EXPECT_NE(fcntl(accepted, F_GETFD) & FD_CLOEXEC, 0);
  close(accepted);
}

TEST_F(AcceptorTest, BeyondTheLimitHangsUpUntilOthersAreGone) {
  Listen(3);
  std::vector<ClientSocket> inside;
  for (int i = 0; i < 3; ++i) {
    inside.push_back(Connect());
  }
  ASSERT_TRUE(WaitFor([this] { return served_.size() == 3; }));
  EXPECT_TRUE(Connect().HangsUpWithin(10000));
  EXPECT_TRUE(Connect().HangsUpWithin(10000));
  EXPECT_EQ(served_.size(), 3U);
  served_.DropAll();
  // Those that come while it still believes a count of some milliseconds ago are turned away.
  std::vector<ClientSocket> again;
  EXPECT_TRUE(WaitFor([&] {
    again.push_back(Connect());
    return served_.size() > 0;
  }));
}

// As long as this lives there is no descriptor left in this process.
class NoDescriptorsLeft {
 public:
  NoDescriptorsLeft() {
    getrlimit(RLIMIT_NOFILE, &before_);
    rlimit lower = before_;
    lower.rlim_cur = std::min<rlim_t>(before_.rlim_cur, 512);
    setrlimit(RLIMIT_NOFILE, &lower);
    for (int fd = 0; fd >= 0;) {
      fd = dup(STDERR_FILENO);
      if (fd >= 0) {
        taken_.push_back(fd);
      }
    }
  }
  ~NoDescriptorsLeft() {
    std::for_each(taken_.begin(), taken_.end(), close);
    setrlimit(RLIMIT_NOFILE, &before_);
  }
  NoDescriptorsLeft(const NoDescriptorsLeft&) = delete;
  NoDescriptorsLeft& operator=(const NoDescriptorsLeft&) = delete;

 private:
  rlimit before_{};
  std::vector<int> taken_;
};

TEST_F(AcceptorTest, WithoutDescriptorsHangsUpAndGoesOnWhenThereAreSome) {
  // It looks whether memory can be read by writing it to a pipe, for which there is none.
  if (testing::kSanitized) GTEST_SKIP() << "UBSan takes objects for none without descriptors";
  Listen(1000);
  // Made before: this process has no more either.
  std::vector<ClientSocket> early(20);
  {
    const NoDescriptorsLeft none;
    for (const ClientSocket& client : early) {
      ASSERT_TRUE(client.Connect(address_));
    }
    for (const ClientSocket& client : early) {
      EXPECT_TRUE(client.HangsUpWithin(10000));
    }
    EXPECT_EQ(served_.size(), 0U);
  }
  const ClientSocket late = Connect();
  EXPECT_TRUE(WaitFor([this] { return served_.size() == 1; }));
}

TEST_F(AcceptorTest, StoppedNobodyConnectsAndThoseInsideStay) {
  Listen(10);
  const ClientSocket inside = Connect();
  ASSERT_TRUE(WaitFor([this] { return served_.size() == 1; }));
  acceptor_->Stop();
  EXPECT_FALSE(ClientSocket().Connect(address_));
  EXPECT_FALSE(inside.HangsUpWithin(50));
}

TEST_F(AcceptorTest, HangingUpEndsThoseInsideAndWaitsForTheirServer) {
  Listen(10);
  const ClientSocket inside = Connect();
  ASSERT_TRUE(WaitFor([this] { return served_.size() == 1; }));
  std::jthread server([this] { EXPECT_TRUE(served_.ReadsTheEnd()); });
  acceptor_->HangUp(std::chrono::minutes(1));
  server.join();
  EXPECT_TRUE(inside.HangsUpWithin(10000));
  EXPECT_FALSE(ClientSocket().Connect(address_));
}

TEST_F(AcceptorTest, HangingUpDoesNotWaitForEver) {
  Listen(10);
  const ClientSocket inside = Connect();
  ASSERT_TRUE(WaitFor([this] { return served_.size() == 1; }));
  acceptor_->HangUp(std::chrono::milliseconds(10));  // nobody closes it
  EXPECT_EQ(served_.size(), 1U);
}

using Addition = Connections::Addition;

TEST(Connections, CountWhatIsOpenWhoeverHasTheDescriptorsNow) {
  constexpr ConnectionLimits kLimits{.all = 3, .one_machine = 3};
  Connections connections;
  std::vector<ClientSocket> sockets(3);
  for (const ClientSocket& socket : sockets) {
    EXPECT_EQ(connections.Add(socket.fd(), "a", kLimits), Addition::kDone);
  }
  EXPECT_EQ(connections.Count(), 3U);
  EXPECT_EQ(connections.Add(STDIN_FILENO, "a", kLimits), Addition::kFull);
  // Another socket, and something that is none, under the same numbers.
  const int first = sockets[0].fd();
  const int second = sockets[1].fd();
  const ClientSocket other;
  dup2(other.fd(), first);
  dup2(STDERR_FILENO, second);
  EXPECT_EQ(connections.Count(), 1U);
  sockets[2].Close();
  EXPECT_EQ(connections.Count(), 0U);
}

TEST(Connections, OfOneMachineLeaveRoomToOthers) {
  constexpr ConnectionLimits kLimits{.all = 3, .one_machine = 2};
  Connections connections;
  std::vector<ClientSocket> sockets(5);
  EXPECT_EQ(connections.Add(sockets[0].fd(), "a", kLimits), Addition::kDone);
  EXPECT_EQ(connections.Add(sockets[1].fd(), "a", kLimits), Addition::kDone);
  EXPECT_EQ(connections.Add(sockets[2].fd(), "a", kLimits), Addition::kMachineFull);
  EXPECT_EQ(connections.Add(sockets[3].fd(), "b", kLimits), Addition::kDone);
  EXPECT_EQ(connections.Add(sockets[4].fd(), "c", kLimits), Addition::kFull);
  sockets[0].Close();
  EXPECT_TRUE(WaitFor([&] {
    return connections.Add(sockets[2].fd(), "a", kLimits) == Addition::kDone;
  })) << "counts what it looked at a moment ago";
}

using std::chrono::milliseconds;

constexpr ConnectionLimits kRoom{.all = 10, .one_machine = 10};

// Two ends of a connection, of which ours does not block.
struct SocketPair {
  SocketPair() {
    int fds[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, fds), 0);
    ours = fds[0];
    theirs = fds[1];
  }
  ~SocketPair() {
    close(ours);
    close(theirs);
  }
  SocketPair(const SocketPair&) = delete;
  SocketPair& operator=(const SocketPair&) = delete;

  [[nodiscard]] bool IsCutOff() const {
    pollfd polled{.fd = ours, .events = 0, .revents = 0};
    return poll(&polled, 1, 0) == 1 && (polled.revents & POLLHUP) != 0;
  }

  int ours = -1;
  int theirs = -1;
};

TEST(Connections, OfThoseThatTakeNothingAreCutOff) {
  const SocketPair stopped;
  const SocketPair slow;
  const SocketPair idle;
  Connections connections;
  for (const SocketPair* pair : {&stopped, &slow, &idle}) {
    ASSERT_EQ(connections.Add(pair->ours, "a", kRoom), Addition::kDone);
  }
  std::string part(10000, 'x');
  const auto size = static_cast<ssize_t>(part.size());
  for (const SocketPair* pair : {&stopped, &slow}) {
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(write(pair->ours, part.data(), part.size()), size);
    }
  }
  connections.CutOffStalled({.at_once = milliseconds(20)}, std::chrono::minutes(1));
  connections.CutOffStalled({.at_once = milliseconds(20)}, std::chrono::minutes(1));
  std::this_thread::sleep_for(milliseconds(30));
  ASSERT_EQ(read(slow.theirs, part.data(), part.size()), size);
  connections.CutOffStalled({.at_once = milliseconds(20)}, milliseconds(1));
  EXPECT_FALSE(stopped.IsCutOff()) << "that was long ago";
  std::this_thread::sleep_for(milliseconds(30));
  ASSERT_EQ(read(slow.theirs, part.data(), part.size()), size);
  connections.CutOffStalled({.at_once = milliseconds(20)}, std::chrono::minutes(1));
  EXPECT_TRUE(stopped.IsCutOff());
  EXPECT_FALSE(slow.IsCutOff());
  EXPECT_FALSE(idle.IsCutOff());
}

int UnreadOf(int fd) {
  int bytes = 0;
  ioctl(fd, SIOCOUTQ, &bytes);
  return bytes;
}

// What is sent as fast as it is taken is never less.
TEST(Connections, OfThoseThatTakeSomethingStayWhateverIsLeftUnlessItIsTooLittle) {
  auto sockets = ListeningSocket::Bind("127.0.0.1:0");
  ASSERT_TRUE(sockets.ok() && sockets->front().Listen().ok());
  ClientSocket client;
  const int room = 4096;
  setsockopt(client.fd(), SOL_SOCKET, SO_RCVBUF, &room, sizeof(room));
  ASSERT_TRUE(client.Connect(sockets->front().address()));
  const FileDescriptor ours(
      accept4(sockets->front().fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  ASSERT_TRUE(ours.ok());
  std::string bytes(1 << 16, 'x');
  int unread = -1;
  ASSERT_EQ(write(ours.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  ASSERT_TRUE(WaitFor([&] {
    const int was = unread;
    unread = UnreadOf(ours.get());
    return unread > 0 && unread == was;
  }));
  const int before = unread;
  const auto take_and_send = [&] {
    std::this_thread::sleep_for(milliseconds(30));
    ASSERT_TRUE(WaitFor([&] {
      EXPECT_GE(recv(client.fd(), bytes.data(), 64, MSG_DONTWAIT), -1);
      return UnreadOf(ours.get()) < before;
    }));
    while (UnreadOf(ours.get()) < before) {
      const auto missing = static_cast<size_t>(before - UnreadOf(ours.get()));
      ASSERT_GT(send(ours.get(), bytes.data(), std::min(missing, bytes.size()), MSG_NOSIGNAL), 0);
    }
    ASSERT_EQ(UnreadOf(ours.get()), before);
  };
  Connections lenient;
  ASSERT_EQ(lenient.Add(ours.get(), "a", kRoom), Addition::kDone);
  PatienceLimits limits{.at_once = milliseconds(20)};
  lenient.CutOffStalled(limits, std::chrono::minutes(1));
  for (int i = 0; i < 3; ++i) {
    ASSERT_NO_FATAL_FAILURE(take_and_send());
    lenient.CutOffStalled(limits, std::chrono::minutes(1));
  }
  EXPECT_EQ(send(ours.get(), "x", 1, MSG_NOSIGNAL), 1);
  ASSERT_TRUE(WaitFor([&] {
    EXPECT_GE(recv(client.fd(), bytes.data(), 64, MSG_DONTWAIT), -1);
    return UnreadOf(ours.get()) <= before;
  }));
  Connections strict;
  ASSERT_EQ(strict.Add(ours.get(), "a", kRoom), Addition::kDone);
  limits.bytes_per_second = 1'000'000'000;
  strict.CutOffStalled(limits, std::chrono::minutes(1));
  ASSERT_NO_FATAL_FAILURE(take_and_send());
  strict.CutOffStalled(limits, std::chrono::minutes(1));
  EXPECT_EQ(send(ours.get(), "x", 1, MSG_NOSIGNAL), -1);
}

TEST(ListeningSocket, TellsWhereItIsAndWhetherOthersCanConnect) {
  const Folder folder;
  const auto at = [](const std::string& address) {
    auto sockets = ListeningSocket::Bind(address);
    EXPECT_TRUE(sockets.ok()) << sockets.status();
    return *std::move(sockets);
  };
  const auto v4 = at("127.0.0.1:0");
  ASSERT_EQ(v4.size(), 1U);
  EXPECT_THAT(v4[0].address(), StartsWith("127.0.0.1:"));
  EXPECT_THAT(v4[0].address(), ::testing::Not(::testing::EndsWith(":0")));
  EXPECT_TRUE(v4[0].local());
  EXPECT_TRUE(at("127.9.8.7:0")[0].local());
  EXPECT_TRUE(at("unix:" + folder / "socket")[0].local());
  // Bound, but not listening: nobody can connect to these.
  EXPECT_FALSE(at("0.0.0.0:0")[0].local());
  for (const ListeningSocket& socket : at("localhost:0")) {
    EXPECT_TRUE(socket.local());
    EXPECT_THAT(socket.address(), StartsWith("localhost:"));
  }
}

TEST(ListeningSocket, ErrorsNameTheAddress) {
  auto first = ListeningSocket::Bind("127.0.0.1:0");
  ASSERT_TRUE(first.ok());
  ASSERT_TRUE(first->front().Listen().ok());
  const std::string taken = first->front().address();
  EXPECT_THAT(std::string(ListeningSocket::Bind(taken).status().message()),
              HasSubstr("--address " + taken + ": cannot listen there: Address already in use"));
  EXPECT_THAT(std::string(ListeningSocket::Bind("no.such.host.invalid:1").status().message()),
              HasSubstr("--address no.such.host.invalid:1: no such host"));
  EXPECT_THAT(std::string(ListeningSocket::Bind("192.0.2.1:1").status().message()),
              HasSubstr("--address 192.0.2.1:1: cannot listen there"));
}

TEST(ListeningSocket, AdoptsOnlyWhatListens) {
  auto bound = ListeningSocket::Bind("127.0.0.1:0");
  ASSERT_TRUE(bound.ok());
  EXPECT_FALSE(ListeningSocket::Adopt(bound->front().fd()).ok());
  ASSERT_TRUE(bound->front().Listen().ok());
  const auto adopted = ListeningSocket::Adopt(dup(bound->front().fd()));
  ASSERT_TRUE(adopted.ok()) << adopted.status();
  EXPECT_EQ(adopted->address(), bound->front().address());
  EXPECT_TRUE(adopted->local());
  EXPECT_FALSE(ListeningSocket::Adopt(STDERR_FILENO).ok());
  EXPECT_FALSE(ListeningSocket::Adopt(12345).ok());
}

}  // namespace
}  // namespace halflight
