// A listener that cannot be killed: crowds, garbage, half-open connections, no descriptors left.

#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "halflight/v1/service.grpc.pb.h"
#include "tests/listen/client_socket.h"
#include "tests/listen/daemon.h"

namespace halflight {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
using testing::ClientSocket;
using testing::Daemon;
using testing::Folder;
using ::testing::HasSubstr;
using testing::Health;
using testing::kServing;
using testing::LongTests;
using testing::NewChannel;
using testing::Process;
using testing::WaitFor;

int64_t MillisecondsSince(Clock::time_point start) {
  return std::chrono::duration_cast<milliseconds>(Clock::now() - start).count();
}

// Tells a time; where the machine is asked for it, holds it to its bound.
void Tell(const char* what, int64_t took, int64_t bound) {
  std::printf("%s: %ld ms, promised %ld ms\n", what, static_cast<long>(took),
              static_cast<long>(bound));
  if (LongTests()) {
    EXPECT_LE(took, bound) << what;
  }
}

// Asks for health over one connection until it goes, and keeps the longest wait.
class HealthProbe {
 public:
  explicit HealthProbe(const std::string& address) : channel_(NewChannel(address)) {
    EXPECT_EQ(Health(channel_), kServing);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const auto start = Clock::now();
        all_well_ = all_well_ && Health(channel_) == kServing;
        longest_ms_ = std::max(longest_ms_.load(), MillisecondsSince(start));
        std::this_thread::sleep_for(milliseconds(5));
      }
    });
  }
  ~HealthProbe() {
    thread_ = std::jthread();
    EXPECT_TRUE(all_well_);
    Tell("longest wait for health", longest_ms_, 100);
  }
  HealthProbe(const HealthProbe&) = delete;
  HealthProbe& operator=(const HealthProbe&) = delete;

 private:
  std::shared_ptr<grpc::Channel> channel_;
  std::atomic<bool> all_well_ = true;
  std::atomic<int64_t> longest_ms_ = 0;
  std::jthread thread_;
};

// Over a new connection: where one was turned away, gRPC makes it again only while somebody waits
// on its channel, and calls that fail at once do not.
bool ServesNewcomers(const std::string& address) { return Health(NewChannel(address)) == kServing; }

void RaiseOwnLimit() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

TEST(Connections, OtherMachinesAreKeptOutUnlessAFlagSaysSo) {
  const Folder folder;
  for (const char* address : {"0.0.0.0:0", "0:0"}) {
    Process server(folder, "halflightd_fake", {"--address", address});
    EXPECT_EQ(server.Wait(), 2);
    EXPECT_THAT(server.Err(), HasSubstr("--insecure-listen"));
    EXPECT_THAT(server.Err(), ::testing::Not(HasSubstr("listening")));
  }
}

TEST(Connections, CrowdIsServedAndHealthWithIt) {
  RaiseOwnLimit();
  const int clients = LongTests() ? 1000 : 100;
  const Folder folder;
  const Daemon server(folder);
  const HealthProbe probe(server.Address());
  struct Call {
    std::unique_ptr<v1::RenderService::Stub> stub;
    grpc::ClientContext context;
    v1::GetServerInfoResponse response;
    grpc::Status status;
    std::unique_ptr<grpc::ClientAsyncResponseReader<v1::GetServerInfoResponse>> reader;
  };
  grpc::CompletionQueue queue;
  std::vector<std::unique_ptr<Call>> calls;
  for (int i = 0; i < clients; ++i) {
    calls.push_back(std::make_unique<Call>());
    Call& call = *calls.back();
    call.stub = v1::RenderService::NewStub(NewChannel(server.Address()));
    call.context.set_wait_for_ready(true);
    call.reader = call.stub->AsyncGetServerInfo(&call.context, {}, &queue);
    call.reader->Finish(&call.response, &call.status, &call);
  }
  for (int i = 0; i < clients; ++i) {
    void* tag = nullptr;
    bool ok = false;
    ASSERT_TRUE(queue.Next(&tag, &ok));
    EXPECT_TRUE(static_cast<Call*>(tag)->status.ok())
        << static_cast<Call*>(tag)->status.error_message();
  }
  EXPECT_GE(server.Count("fd"), static_cast<size_t>(clients)) << "the clients shared connections";
}

TEST(Connections, WithoutDescriptorsThoseInsideAreServedAndOthersWhenSomeAreFree) {
  const Folder folder;
  const Daemon server(folder);
  const std::string address = server.Address();
  const auto inside = NewChannel(address);
  ASSERT_EQ(Health(inside), kServing);

  rlimit before{};
  ASSERT_EQ(prlimit(server.pid(), RLIMIT_NOFILE, nullptr, &before), 0);
  rlimit lower = before;
  lower.rlim_cur = server.Count("fd") + 20;
  ASSERT_EQ(prlimit(server.pid(), RLIMIT_NOFILE, &lower, nullptr), 0);
  std::vector<ClientSocket> idle(200);
  for (const ClientSocket& client : idle) {
    ASSERT_TRUE(client.Connect(address));
  }
  EXPECT_TRUE(WaitFor([&] { return server.Logged("no descriptors are left"); })) << server.Err();
  EXPECT_TRUE(idle.back().HangsUpWithin(10000));
  EXPECT_EQ(Health(inside), kServing);
  EXPECT_EQ(Health(NewChannel(address), milliseconds(500)), "") << "there was room";

  // The same descriptors, given back: the limit stays.
  idle.clear();
  const auto start = Clock::now();
  EXPECT_TRUE(WaitFor([&] { return ServesNewcomers(address); }));
  Tell("serving again", MillisecondsSince(start), 1000);
  EXPECT_EQ(Health(inside), kServing);
}

TEST(Connections, BeyondTheirLimitAreClosedAtOnceAndTellItInTheLog) {
  const Folder folder;
  const Daemon server(folder, {"--max-connections", "3"});
  const auto inside = NewChannel(server.Address());
  ASSERT_EQ(Health(inside), kServing);
  std::vector<ClientSocket> others(2);
  for (const ClientSocket& client : others) {
    ASSERT_TRUE(client.Connect(server.Address()));
  }
  ASSERT_TRUE(WaitFor([&] {
    ClientSocket fourth;
    return fourth.Connect(server.Address()) && fourth.HangsUpWithin(100);
  }));
  // Told right after.
  EXPECT_TRUE(WaitFor([&] { return server.Logged("max_connections"); })) << server.Err();
  EXPECT_EQ(Health(inside), kServing);
  others.clear();
  EXPECT_TRUE(WaitFor([&] { return ServesNewcomers(server.Address()); }));
}

TEST(Connections, GarbageAndSilenceEndInTimeAndHurtNobody) {
  const Folder folder;
  const Daemon server(folder, {"--max-handshake-seconds", "1"});
  const HealthProbe probe(server.Address());
  const std::string preface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  std::vector<std::string> openings = {
      "",  // connects, and is silent
      "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
      std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11),  // TLS says hello
      std::string(100000, 'x'),
      std::string(1000, '\0'),
      preface.substr(0, 10),
      preface,
      preface + std::string("\x00\x00\x00\x04\x00\x00\x00\x00", 8),      // settings, cut off
      preface + std::string("\xff\xff\xff\x04\x00\x00\x00\x00\x00", 9),  // 16 MB of settings
      preface + std::string("\x00\x00\x04\x08\x00\x00\x00\x00\x00\x7f\xff\xff\xff", 13)};
  uint32_t random = 1;
  for (int i = 0; i < 20; ++i) {
    std::string bytes;
    for (int k = 0; k < 500; ++k) {
      random = random * 1664525U + 1013904223U;
      bytes += static_cast<char>(random >> 24U);
    }
    openings.push_back(i % 2 == 0 ? bytes : preface + bytes);
  }
  std::vector<ClientSocket> clients(openings.size());
  for (size_t i = 0; i < openings.size(); ++i) {
    ASSERT_TRUE(clients[i].Connect(server.Address()));
    clients[i].Send(openings[i]);
  }
  for (size_t i = 0; i < openings.size(); ++i) {
    EXPECT_TRUE(clients[i].HangsUpWithin(20000)) << "opening " << i;
  }
}

TEST(Connections, IdleOnesAreClosedAndTheirClientsNoticeNothing) {
  const Folder folder;
  const Daemon server(folder, {"--max-idle-seconds", "1"});
  client::ClientOptions options;
  options.max_attempts = 1;
  auto client = client::Client::Connect(server.Address(), options);
  ASSERT_TRUE(client.ok());
  ASSERT_TRUE(client->GetServerInfo().ok());
  const size_t connected = server.Count("fd");
  EXPECT_TRUE(WaitFor([&] { return server.Count("fd") < connected; })) << "it was kept";
  const auto again = client->GetServerInfo();
  EXPECT_TRUE(again.ok()) << again.status();
}

TEST(Connections, StrangersCannotMakeThreadsByAskingForReflection) {
  const Folder folder;
  const Daemon server(folder);
  const auto inside = NewChannel(server.Address());
  ASSERT_EQ(Health(inside), kServing);
  const size_t threads = server.Count("task");
  grpc::CompletionQueue queue;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::GenericClientAsyncReaderWriter>> streams;
  grpc::GenericStub stub(NewChannel(server.Address()));
  for (int i = 0; i < 90; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(
        stub.PrepareCall(contexts.back().get(),
                         "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue));
    streams.back()->StartCall(nullptr);
  }
  for (int i = 0; i < 90; ++i) {
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
  }
  // They have begun here, and soon do there.
  std::this_thread::sleep_for(milliseconds(500));
  EXPECT_LT(server.Count("task"), threads + 40);
  EXPECT_EQ(Health(inside), kServing);
  for (const auto& context : contexts) {
    context->TryCancel();
  }
}

}  // namespace
}  // namespace halflight
