// The little HTTP that Prometheus needs, and clients that do not behave.

#include "server/metrics/metrics_server.h"

#include <chrono>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/listen/client_socket.h"
#include "tests/metrics/page.h"

namespace halflight {
namespace {

using testing::ClientSocket;
using ::testing::EndsWith;
using testing::Exchange;
using testing::Get;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class MetricsOverHttp : public ::testing::Test {
 protected:
  MetricsOverHttp() {
    auto sockets = BindMetricsAddress({.address = "127.0.0.1:0"});
    EXPECT_TRUE(sockets.ok()) << sockets.status();
    address_ = sockets->front().address();
    auto server = MetricsServer::Start(
        *std::move(sockets), [this] { return page_; }, std::chrono::hours(1));
    EXPECT_TRUE(server.ok());
    server_ = *std::move(server);
  }

  std::string page_ = "up 1\n";
  std::string address_;
  std::unique_ptr<MetricsServer> server_;
};

TEST_F(MetricsOverHttp, OnePathAndOneMethod) {
  const std::string page = Get(address_, "/metrics");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(page, HasSubstr("Content-Type: text/plain; version=0.0.4"));
  EXPECT_THAT(page, HasSubstr("Content-Length: 5\r\n"));
  EXPECT_THAT(page, EndsWith("\r\n\r\nup 1\n"));
  EXPECT_THAT(Get(address_, "/metrics?name=up"), EndsWith("\r\n\r\nup 1\n"));
  EXPECT_THAT(Get(address_, "/"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(Get(address_, "/metricsx"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(Get(address_, "/../metrics"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(Exchange(address_, "POST /metrics HTTP/1.1\r\n\r\n"), StartsWith("HTTP/1.1 405 "));
  EXPECT_THAT(Exchange(address_, "nonsense\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  const std::string head = Exchange(address_, "HEAD /metrics HTTP/1.1\r\n\r\n");
  EXPECT_THAT(head, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(head, EndsWith("\r\n\r\n"));
}

TEST_F(MetricsOverHttp, PagesMayBeLarge) {
  page_ = std::string(20'000'000, 'x');
  EXPECT_GT(Get(address_, "/metrics").size(), page_.size());
}

TEST_F(MetricsOverHttp, WhoSaysNothingHoldsNobodyUp) {
  ClientSocket silent;
  ASSERT_TRUE(silent.Connect(address_));
  ASSERT_TRUE(silent.Send("GET /met"));
  EXPECT_THAT(Get(address_, "/metrics"), StartsWith("HTTP/1.1 200 OK\r\n"));
  // Without an end it is cut off.
  ClientSocket endless;
  ASSERT_TRUE(endless.Connect(address_));
  EXPECT_TRUE(endless.Send(std::string(10'000, 'x')));
  EXPECT_TRUE(endless.HangsUpWithin(60'000));
  EXPECT_THAT(Get(address_, "/metrics"), StartsWith("HTTP/1.1 200 OK\r\n"));
  // Who is connected is not waited for.
  server_.reset();
  EXPECT_TRUE(silent.HangsUpWithin(1000));
  EXPECT_EQ(Get(address_, "/metrics"), "");
}

TEST(MetricsAddress, IsThisMachinesUnlessToldOtherwise) {
  EXPECT_TRUE(BindMetricsAddress({})->empty());
  EXPECT_TRUE(BindMetricsAddress({.address = "localhost:0"}).ok());
  const auto refused = BindMetricsAddress({.address = "0.0.0.0:0"});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.status().message()), StartsWith("--metrics-address: 0.0.0.0:"));
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--insecure-metrics"));
  EXPECT_TRUE(BindMetricsAddress({.address = "0.0.0.0:0", .insecure = true}).ok());
}

}  // namespace
}  // namespace halflight
