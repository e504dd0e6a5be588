// halflightd as a service manager sees it: starts with the real renderer or says why not, answers
// the standard questions, and ends when told to, with its work done.

#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "client/client.h"
#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

using testing::Folder;
using ::testing::HasSubstr;
using testing::PlumePath;
using testing::Process;
using testing::WaitFor;

// A call of a service whose stubs are not built here: one message there, the first one back.
std::string AskOnce(const std::string& address, const std::string& method,
                    const std::string& request) {
  grpc::GenericStub stub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  const grpc::Slice slice(request);
  const auto call = stub.PrepareUnaryCall(&context, method, grpc::ByteBuffer(&slice, 1), &queue);
  grpc::ByteBuffer answer;
  grpc::Status status;
  call->StartCall();
  call->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  EXPECT_TRUE(status.ok()) << status.error_message();
  std::vector<grpc::Slice> slices;
  if (status.ok()) {
    answer.Dump(&slices);
  }
  std::string bytes;
  for (const grpc::Slice& part : slices) {
    bytes.append(reinterpret_cast<const char*>(part.begin()), part.size());
  }
  return bytes;
}

TEST(DaemonProcess, AnswersHealthAndReflectionAndListensTwice) {
  const Folder folder;
  const Process server(folder, "halflightd",
                       {"--address", "127.0.0.1:0", "--address", "unix:" + folder / "socket"});
  for (const std::string& address : {server.Address(), "unix:" + folder / "socket"}) {
    // HealthCheckResponse { status = 1: SERVING }, of the whole server and of the one service.
    EXPECT_EQ(AskOnce(address, "/grpc.health.v1.Health/Check", ""), "\x08\x01");
    // ServerReflectionRequest { list_services = 7: "" }.
    const std::string listed =
        AskOnce(address, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                std::string("\x3a\x00", 2));
    EXPECT_THAT(listed, HasSubstr("halflight.v1.RenderService"));
    EXPECT_THAT(listed, HasSubstr("grpc.health.v1.Health"));
    // ServerReflectionRequest { file_containing_symbol = 4: "..." }.
    const std::string symbol = "halflight.v1.RenderService";
    const std::string file =
        AskOnce(address, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                "\x22" + std::string(1, static_cast<char>(symbol.size())) + symbol);
    EXPECT_THAT(file, HasSubstr("RenderSequence"));
  }
}

TEST(DaemonProcess, OnSigtermTheFrameThatRendersIsDelivered) {
  const Folder folder;
  Process server(folder, "halflightd",
                 {"--address", "127.0.0.1:0", "--max-queued-frames", "1", "--drain-seconds", "60"});
  client::ClientOptions options;
  options.max_attempts = 1000;
  auto client = client::Client::Connect(server.Address(), options);
  ASSERT_TRUE(client.ok()) << client.status();
  // Some seconds of work.
  Scene scene = test::BallScene(20000, 256);
  scene.shadow.slices = 4000;
  scene.shadow.light_buffer_size = 256;
  absl::StatusOr<client::RenderedFrame> frame;
  std::jthread caller([&] { frame = client->RenderFrame(RequestOf(scene)); });

  // With room for one frame, another one is refused as soon as that one is under way.
  const auto stub = v1::RenderService::NewStub(
      grpc::CreateChannel(server.Address(), grpc::InsecureChannelCredentials()));
  const v1::RenderFrameRequest probe = RequestOf(test::BallScene(1, 8));
  ASSERT_TRUE(WaitFor(
      [&] { return Ask(*stub, probe).error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED; }));
  server.Signal(SIGTERM);
  ASSERT_TRUE(WaitFor([&] { return server.Err().find("draining") != std::string::npos; }));
  EXPECT_EQ(Ask(*stub, probe).error_code(), grpc::StatusCode::UNAVAILABLE);
  caller.join();
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->outputs[0].size(), 256U * 256U * 16U);
  EXPECT_EQ(server.Wait(), 0) << server.Err();
}

TEST(DaemonProcess, LogsALineAFrameWithItsTimings) {
  const Folder folder;
  Process server(folder, "halflightd", {"--address", "127.0.0.1:0"});
  auto client = client::Client::Connect(server.Address());
  ASSERT_TRUE(client.ok());
  v1::RenderFrameRequest request = RequestOf(test::BallScene(50, 16));
  request.set_request_id("find-me");
  MustRender(*client, request);
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
  const std::string log = server.Err();
  const size_t at = log.find("find-me");
  ASSERT_NE(at, std::string::npos) << log;
  const size_t start = log.rfind('\n', at) + 1;
  const std::string line = log.substr(start, log.find('\n', at) - start);
  for (const char* part : {"queue", "encode", "total", "outcome=OK"}) {
    EXPECT_THAT(line, HasSubstr(part));
  }
}

TEST(DaemonProcess, SaysWhyItDoesNotStart) {
  const Folder folder;
  const Process first(folder, "halflightd", {"--address", "127.0.0.1:0"});
  struct Case {
    std::vector<std::string> arguments;
    int code;
    std::string text;
  };
  for (const Case& wrong :
       {Case{{"--address", first.Address()}, 1, first.Address()},
        Case{{"--address", "unix:" + folder / "no/such/folder"}, 1, "no/such/folder"},
        Case{{"--device", "cuda:99"}, 1, "cuda:99"},
        Case{{"--device", "drm:/dev/dri/card77"}, 1, "/dev/dri/card77"},
        Case{{"--device", "uuid:00000000000000000000000000000000"}, 1, "0000000000000000"},
        Case{{"--device", "banana"}, 1, "banana"},
        Case{{"--address", "nonsense"}, 2, "--address: nonsense"},
        Case{{"--max-slices", "0"}, 2, "--max-slices: 0"},
        Case{{"--max-cache-bytes", "-1"}, 2, "--max-cache-bytes"},
        Case{{"--log-level", "loud"}, 2, "--log-level: loud"},
        Case{{"--frobnicate"}, 2, "--frobnicate"}}) {
    Process server(folder, "halflightd", wrong.arguments);
    EXPECT_EQ(server.Wait(), wrong.code) << wrong.text << ": " << server.Err();
    EXPECT_THAT(server.Err(), HasSubstr(wrong.text));
  }
}

TEST(DaemonProcess, ClientThatVanishesLeavesTheServerAlone) {
  const Folder folder;
  const Process server(folder, "halflightd", {"--address", "127.0.0.1:0"});
  {
    const Process killed(folder, "halflight",
                         {"render", PlumePath("0040"), "--server", server.Address(), "-o",
                          folder / "f.png", "--size", "1024x1024", "--supersample", "4", "--slices",
                          "50000", "--request-id", "vanishes"});
    // Its particles have been read when it has told what it chose.
    ASSERT_TRUE(WaitFor([&] { return killed.Out().find("camera") != std::string::npos; }));
  }
  auto client = client::Client::Connect(server.Address());
  ASSERT_TRUE(client.ok());
  MustRender(*client, RequestOf(test::BallScene(50, 16)));
}

}  // namespace
}  // namespace halflight::loopback
