// halflightd on a device that fails, as a client and a service manager see it.

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "client/client.h"
#include "halflight/v1/service.grpc.pb.h"
#include "tests/access/health.h"
#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

using testing::Folder;
using ::testing::HasSubstr;
using testing::Process;
using testing::WaitFor;

class DeviceFaults : public ::testing::Test {
 protected:
  void Start(const std::string& faults, std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--address", "127.0.0.1:0", "--plan-device-faults", faults});
    server_.emplace(folder_, "halflightd", std::move(more));
    stub_ = v1::RenderService::NewStub(testing::NewChannel(server_->Address()));
  }
  grpc::Status Draw(int particles) {
    return Ask(*stub_, RequestOf(test::BallScene(static_cast<size_t>(particles), 32)));
  }

  const Folder folder_;
  std::optional<Process> server_;
  std::unique_ptr<v1::RenderService::Stub> stub_;
};

// Every request of its own kind is an own one; request ids do not matter.
TEST_F(DeviceFaults, RequestThatResetsTheDeviceTwiceIsRefusedAndOthersAreServed) {
  Start("reset:2-3");
  EXPECT_TRUE(Draw(10).ok());
  for (int i = 0; i < 2; ++i) {
    v1::RenderFrameRequest deadly = RequestOf(test::BallScene(20, 32));
    deadly.set_request_id("attempt " + std::to_string(i));
    const grpc::Status reset = Ask(*stub_, deadly);
    EXPECT_EQ(reset.error_code(), grpc::StatusCode::UNAVAILABLE) << reset.error_message();
    EXPECT_THAT(reset.error_details(), HasSubstr("DEVICE_RESET"));
  }
  const grpc::Status refused = Draw(20);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << refused.error_message();
  EXPECT_THAT(refused.error_details(), HasSubstr("FAULTED_TWICE"));
  EXPECT_TRUE(Draw(10).ok());
  EXPECT_TRUE(Draw(30).ok());
}

TEST_F(DeviceFaults, WithoutMemoryTheFrameMayBeTriedLater) {
  Start("out-of-memory:1-2");
  const grpc::Status full = Draw(10);
  EXPECT_EQ(full.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << full.error_message();
  EXPECT_THAT(full.error_details(), HasSubstr("DEVICE_MEMORY_FULL"));
  Draw(10);  // what there is to drop has an effect on how often it is tried
  EXPECT_TRUE(Draw(10).ok());
}

// The frame's time is up, it is told to stop, and does not come back.
TEST_F(DeviceFaults, DeviceThatHangsIsReportedAndEndsTheServer) {
  Start("hang:2", {"--max-frame-seconds", "1", "--watchdog-seconds", "1"});
  EXPECT_TRUE(Draw(10).ok());
  const auto channel = testing::NewChannel(server_->Address());
  EXPECT_EQ(testing::Health(channel), testing::kServing);
  grpc::ClientContext context;
  const auto call = stub_->RenderFrame(&context, RequestOf(test::BallScene(20, 32)));
  EXPECT_TRUE(WaitFor([&] { return testing::Health(channel) == testing::kNotServing; }));
  EXPECT_EQ(server_->Wait(), 4) << server_->Err();
  EXPECT_THAT(server_->Err(), HasSubstr("the device hangs"));
  v1::RenderFrameResponse response;
  EXPECT_FALSE(call->Read(&response));
  EXPECT_FALSE(call->Finish().ok());
}

TEST_F(DeviceFaults, DeviceThatCannotBeHadAgainEndsTheServer) {
  Start("gone:1");
  EXPECT_EQ(Draw(10).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(server_->Wait(), 4) << server_->Err();
  EXPECT_THAT(server_->Err(), HasSubstr("cannot be had again"));
}

}  // namespace
}  // namespace halflight::loopback
