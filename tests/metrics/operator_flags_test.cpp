// What halflightd shows to whom, and that it says so when it cannot.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/access/health.h"
#include "tests/metrics/page.h"
#include "tests/process/process.h"

namespace halflight {
namespace {

using testing::CallRaw;
using testing::Folder;
using ::testing::HasSubstr;
using testing::NewChannel;
using ::testing::Not;
using testing::Process;
using ::testing::StartsWith;

constexpr const char* kGetServers = "/grpc.channelz.v1.Channelz/GetServers";

TEST(MetricsFlags, ErrorsAreToldAtStart) {
  const Folder folder;
  const Process taken(folder, "halflightd_fake", {"--address", "127.0.0.1:0"});
  const std::string address = taken.Address();
  struct Case {
    std::vector<std::string> flags;
    int code;
    std::string text;
  };
  for (const Case& wrong :
       {Case{{"--metrics-address", address}, 1, "--metrics-address " + address + ": cannot listen"},
        Case{{"--metrics-address", "nowhere"}, 2, "--metrics-address: nowhere, allowed: host:port"},
        Case{{"--metrics-address", "0.0.0.0:0"}, 2, "--insecure-metrics"},
        Case{{"--log-format", "xml"}, 2, "--log-format: xml"}}) {
    std::vector<std::string> flags = {"--address", "127.0.0.1:0"};
    flags.insert(flags.end(), wrong.flags.begin(), wrong.flags.end());
    Process server(folder, "halflightd_fake", flags);
    EXPECT_EQ(server.Wait(), wrong.code) << server.Err();
    EXPECT_THAT(server.Err(), HasSubstr(wrong.text));
    EXPECT_THAT(server.Err(), Not(HasSubstr("listening")));
  }
}

TEST(LogFlags, WhyItDoesNotStartIsALineLikeAnyOther) {
  const Folder folder;
  Process server(folder, "halflightd_fake", {"--address", "0.0.0.0:0", "--log-format", "json"});
  EXPECT_EQ(server.Wait(), 2);
  EXPECT_THAT(server.Err(), HasSubstr(R"("level":"error","event":"cannot_start","message":")"));
  EXPECT_THAT(server.Err(), StartsWith("{"));
}

TEST(MetricsFlags, OthersMayReadThemOnlyWhenToldAndThenLoudly) {
  const Folder folder;
  const Process server(
      folder, "halflightd_fake",
      {"--address", "127.0.0.1:0", "--metrics-address", "0.0.0.0:0", "--insecure-metrics"});
  ASSERT_NE(server.Address(), "");
  EXPECT_THAT(server.Err(), HasSubstr("level=warning insecure_metrics address=0.0.0.0:"));
}

TEST(MetricsFlags, NoneAreShownUnlessAskedFor) {
  const Folder folder;
  const Process server(folder, "halflightd_fake", {"--address", "127.0.0.1:0"});
  ASSERT_NE(server.Address(), "");
  EXPECT_THAT(server.Err(), Not(HasSubstr(" metrics ")));
}

grpc::StatusCode ChannelzCode(const std::string& address) {
  return CallRaw(NewChannel(address), kGetServers, "").status.error_code();
}

TEST(Channelz, IsServedWhereThereAreNoStrangers) {
  const Folder folder;
  const Process open(folder, "halflightd_fake", {"--address", "127.0.0.1:0"});
  const testing::Answer answer = CallRaw(NewChannel(open.Address()), kGetServers, "");
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_NE(answer.bytes, "") << "no server is listed";
}

TEST(Channelz, IsNotServedWhereOthersCouldAsk) {
  const Folder folder;
  const std::string tokens = folder.Write("tokens", std::string(64, '0') + " somebody\n");
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--address", "127.0.0.1:0", "--channelz", "off"},
        {"--address", "127.0.0.1:0", "--token-file", tokens},
        {"--address", "0.0.0.0:0", "--insecure-listen"}}) {
    const Process closed(folder, "halflightd_fake", flags);
    EXPECT_EQ(ChannelzCode(closed.Address()), grpc::StatusCode::UNIMPLEMENTED)
        << flags.back() << ": " << closed.Err();
  }
  const Process asked(folder, "halflightd_fake",
                      {"--address", "127.0.0.1:0", "--token-file", tokens, "--channelz", "on"});
  EXPECT_EQ(ChannelzCode(asked.Address()), grpc::StatusCode::OK) << asked.Err();
}

TEST(Channelz, WhereOthersCanConnectIsToldLoudly) {
  const Folder folder;
  const Process server(folder, "halflightd_fake",
                       {"--address", "0.0.0.0:0", "--insecure-listen", "--channelz", "on"});
  ASSERT_NE(server.Address(), "");
  EXPECT_THAT(server.Err(), HasSubstr("level=warning insecure_channelz address=0.0.0.0:"));
  EXPECT_THAT(server.Err(), HasSubstr("level=warning insecure address=0.0.0.0:"));
}

}  // namespace
}  // namespace halflight
