// SIGTERM, as load balancers and clients see it.

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/listen/client_socket.h"
#include "tests/listen/daemon.h"

namespace halflight {
namespace {

using testing::ClientSocket;
using testing::Daemon;
using testing::Folder;
using testing::Health;
using testing::HealthWatch;
using testing::kNotServing;
using testing::kServing;
using testing::MakeRequest;
using testing::NewChannel;
using testing::WaitFor;

TEST(Drain, SaysSoThenRefusesConnectionsAndCallsThenFinishesWhatRuns) {
  const Folder folder;
  const std::string hold = folder.Write("hold", "");
  const std::string socket = "unix:" + folder / "socket";
  Daemon server(folder, {"--address", socket, "--device", hold});
  const std::string address = server.Address();
  const auto balancer = NewChannel(address);
  ASSERT_EQ(Health(balancer), kServing);
  HealthWatch watch(NewChannel(address));
  ASSERT_EQ(watch.Next(), kServing);
  client::ClientOptions options;
  options.max_attempts = 1;
  auto client = client::Client::Connect(address, options);
  ASSERT_TRUE(client.ok());
  ASSERT_TRUE(client->GetServerInfo().ok());
  absl::Status frame = absl::UnknownError("");
  std::jthread call([&] { frame = client->RenderFrame(MakeRequest()).status(); });
  // The frame is under way: nothing tells so from outside but a little time.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));

  server.Signal(SIGTERM);
  EXPECT_EQ(watch.Next(), kNotServing);
  EXPECT_EQ(Health(balancer), kNotServing);
  EXPECT_TRUE(WaitFor([&] { return !ClientSocket().Connect(address); }));
  EXPECT_TRUE(WaitFor([&] { return !std::filesystem::exists(folder / "socket"); }));
  EXPECT_EQ(client->GetServerInfo().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Health(balancer), kNotServing);

  std::filesystem::remove(hold);
  call.join();
  EXPECT_TRUE(frame.ok()) << frame;
  EXPECT_EQ(server.Wait(), 0) << server.Err();
}

TEST(Drain, LeavesTheSocketOfTheServerThatFollowsAlone) {
  const Folder folder;
  const std::string hold = folder.Write("hold", "");
  const std::string socket = "unix:" + folder / "socket";
  Daemon first(folder, {"--address", socket, "--device", hold});
  ASSERT_FALSE(first.Address().empty());
  auto client = client::Client::Connect(socket);
  ASSERT_TRUE(client.ok());
  std::jthread call([&] { EXPECT_TRUE(client->RenderFrame(MakeRequest()).ok()); });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  first.Signal(SIGTERM);
  ASSERT_TRUE(WaitFor([&] { return !std::filesystem::exists(folder / "socket"); }));

  const Daemon second(folder, {"--address", socket});
  const std::string address = second.Address();
  std::filesystem::remove(hold);
  call.join();
  EXPECT_EQ(first.Wait(), 0) << first.Err();
  EXPECT_TRUE(std::filesystem::exists(folder / "socket"));
  EXPECT_EQ(Health(NewChannel(socket)), kServing);
}

}  // namespace
}  // namespace halflight
