// Clients that leave unread what is sent to them at their sockets, where gRPC's clients never do:
// HTTP/2 by hand, with windows wide open.

#include <sys/ioctl.h>
#include <sys/socket.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/grpc_server.h"
#include "tests/listen/client_socket.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using testing::ClientSocket;
using testing::EncodePlain;
using testing::FakeEngine;
using testing::MakeRequest;
using testing::WaitFor;

std::string BigEndian(uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) {
    text += static_cast<char>(value >> (8 * i) & 0xffU);
  }
  return text;
}

// RFC 9113, section 4.1.
std::string Frame(uint8_t type, uint8_t flags, uint32_t stream, const std::string& payload) {
  return BigEndian(payload.size(), 3) + BigEndian(type, 1) + BigEndian(flags, 1) +
         BigEndian(stream, 4) + payload;
}

// RFC 7541, section 6.2.2: not indexed, not Huffman coded, shorter than 127 bytes.
std::string Header(const std::string& name, const std::string& value) {
  return BigEndian(0, 1) + BigEndian(name.size(), 1) + name + BigEndian(value.size(), 1) + value;
}

// A call with its only message, on windows of 2 GiB.
std::string CallWith(const std::string& rpc, const std::string& message) {
  constexpr uint8_t kData = 0;
  constexpr uint8_t kHeaders = 1;
  constexpr uint8_t kSettings = 4;
  constexpr uint8_t kWindowUpdate = 8;
  constexpr uint8_t kEndStream = 1;
  constexpr uint8_t kEndHeaders = 4;
  constexpr uint64_t kInitialWindowSize = 4;
  constexpr uint64_t kWindow = 0x7fffffff;
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" +
         Frame(kSettings, 0, 0, BigEndian(kInitialWindowSize, 2) + BigEndian(kWindow, 4)) +
         Frame(kWindowUpdate, 0, 0, BigEndian(kWindow - 65535, 4)) +
         Frame(kHeaders, kEndHeaders, 1,
               Header(":method", "POST") + Header(":scheme", "http") +
                   Header(":path", "/halflight.v1.RenderService/" + rpc) +
                   Header(":authority", "test") + Header("te", "trailers") +
                   Header("content-type", "application/grpc")) +
         Frame(kData, kEndStream, 1, BigEndian(0, 1) + BigEndian(message.size(), 4) + message);
}

int UnreadBytes(const ClientSocket& client) {
  int bytes = 0;
  ioctl(client.fd(), FIONREAD, &bytes);
  return bytes;
}

class UnreadCall : public ::testing::TestWithParam<bool> {
 protected:
  explicit UnreadCall(uint32_t stall_seconds = 1) : limits_{.max_stall_seconds = stall_seconds} {
    auto server = GrpcServer::Start(
        {GetParam() ? "unix:" + folder_ / "socket" : std::string("127.0.0.1:0")}, backend_);
    EXPECT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

  // More than fits into the sockets' buffers.
  static v1::RenderFrameRequest LargeRequest() {
    v1::RenderFrameRequest request = MakeRequest();
    request.mutable_scene()->mutable_camera()->set_width(2048);
    request.mutable_scene()->mutable_camera()->set_height(2048);
    return request;
  }

  // Connected, with little room to receive in.
  [[nodiscard]] ClientSocket Connect() const {
    ClientSocket client(GetParam() ? AF_UNIX : AF_INET);
    const int room = 65536;
    setsockopt(client.fd(), SOL_SOCKET, SO_RCVBUF, &room, sizeof(room));
    EXPECT_TRUE(client.Connect(server_->addresses()[0]));
    return client;
  }

  const testing::Folder folder_;
  const ServerLimits limits_;
  const std::string version_ = "1";
  FakeEngine engine_;
  ParticleStore store_{8 << 20};
  ByteBudget upload_memory_{8 << 20};
  PartialUploads partial_uploads_{upload_memory_, {}};
  FramePipeline pipeline_{engine_, {.encode_threads = 1, .encode = EncodePlain}};
  Backend backend_{engine_.device(), limits_, version_, store_, partial_uploads_, pipeline_};
  std::unique_ptr<GrpcServer> server_;
};

TEST_P(UnreadCall, EndsWithItsConnectionWhereTheSocketIsFull) {
  const ClientSocket client = Connect();
  ASSERT_TRUE(client.Send(CallWith("RenderFrame", LargeRequest().SerializeAsString())));
  ASSERT_TRUE(WaitFor([&] { return engine_.rendered() == 1; }));
  EXPECT_FALSE(server_->idle());
  EXPECT_TRUE(WaitFor([&] { return server_->idle(); })) << "the call waits for its reader";
  EXPECT_TRUE(WaitFor([&] { return pipeline_.memory_bytes() == 0; }));
  EXPECT_TRUE(WaitFor([&] { return server_->connections().open == 0; }));
}

class UnreadPatientCall : public UnreadCall {
 protected:
  UnreadPatientCall() : UnreadCall(600) {}
};

TEST_P(UnreadPatientCall, DoesNotHoldUpTheEndOfTheServer) {
  const ClientSocket client = Connect();
  ASSERT_TRUE(client.Send(CallWith("RenderFrame", LargeRequest().SerializeAsString())));
  ASSERT_TRUE(WaitFor([&] { return UnreadBytes(client) > 32768; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // until nothing fits any more
  server_.reset();
  EXPECT_TRUE(WaitFor([&] { return pipeline_.memory_bytes() == 0; }));
}

std::string NameOf(const ::testing::TestParamInfo<bool>& over) {
  return over.param ? "UnixSocket" : "Tcp";
}

INSTANTIATE_TEST_SUITE_P(Over, UnreadCall, ::testing::Bool(), NameOf);
INSTANTIATE_TEST_SUITE_P(Over, UnreadPatientCall, ::testing::Bool(), NameOf);

}  // namespace
}  // namespace halflight
