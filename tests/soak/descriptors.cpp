// No descriptor left in the server, then some again.

#include <chrono>
#include <vector>

#include <sys/resource.h>

#include "tests/access/health.h"
#include "tests/listen/client_socket.h"
#include "tests/process/wait_for.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {

using std::chrono::milliseconds;

void RunDescriptors(Run& run) {
  const testing::Folder folder;
  // Sabotaged: gRPC's own listener.
  const Server server(folder, {}, run.sabotage ? "soak_bad_server" : "halflightd");
  const auto inside = testing::NewChannel(server.address());
  Require(testing::Health(inside) == testing::kServing, "health before the scenario");
  const int turns = run.Of(20, 2);
  double longest_ms = 0.0;
  size_t dead = 0;
  size_t inside_not_served = 0;
  for (int turn = 0; turn < turns; ++turn) {
    const uint64_t before =
        server.SetLimit(RLIMIT_NOFILE, static_cast<uint64_t>(server.Count("fd")) + 20);
    std::vector<testing::ClientSocket> crowd(200);
    for (const testing::ClientSocket& client : crowd) {
      Require(client.Connect(server.address()), "a socket connects");
    }
    // Long enough for a listener to notice, and for one to notice that retries.
    std::this_thread::sleep_for(milliseconds(300));
    inside_not_served += testing::Health(inside, milliseconds(1000)) == testing::kServing ? 0 : 1;

    const auto begin = Clock::now();
    if (turn % 2 == 0) {
      crowd.clear();
    } else {
      server.SetLimit(RLIMIT_NOFILE, before);
    }
    // Each question over a new connection: one that was turned away is not made again by gRPC while
    // nobody waits on its channel.
    const bool served = testing::WaitFor([&] { return server.Serves(); }, std::chrono::seconds(3));
    const std::chrono::duration<double, std::milli> took = Clock::now() - begin;
    dead += served ? 0 : 1;
    longest_ms = std::max(longest_ms, took.count());
    crowd.clear();
    server.SetLimit(RLIMIT_NOFILE, before);
    if (!served) {
      break;
    }
  }
  run.report.AtLeast("times without descriptors", turns, turns, "");
  run.report.None("clients inside that were not served meanwhile", inside_not_served);
  run.report.None("times that newcomers were not served again", dead);
  run.report.TimeAtMost("serving again after descriptors were free, longest", longest_ms, 1000,
                        " ms");
}

}  // namespace halflight::soak
