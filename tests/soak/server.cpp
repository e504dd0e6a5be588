#include "tests/soak/server.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iostream>
#include <map>
#include <utility>

#include <sys/resource.h>

#include "client/client.h"
#include "tests/access/health.h"
#include "tests/listen/client_socket.h"
#include "tests/soak/call.h"
#include "tests/soak/scenario.h"

namespace halflight::soak {
namespace {

using std::chrono::milliseconds;

// Milliseconds that stand for an answer which is none.
constexpr double kNotServing = 1e6;

// Metrics are read where the server has them.
bool HasMetrics(const std::string& program) {
  static std::map<std::string, bool> known;
  const auto [has, unknown] = known.try_emplace(program);
  if (unknown) {
    const testing::Folder folder;
    testing::Process process(folder, program, {"--help"});
    process.Wait();
    has->second = process.Out().find("--metrics-address") != std::string::npos;
  }
  return has->second;
}

std::string AfterKey(const std::string& text, const std::string& key) {
  const size_t at = text.find(key);
  if (at == std::string::npos) {
    return "";
  }
  const size_t from = at + key.size();
  return text.substr(from, text.find('\n', from) - from);
}

std::vector<std::string> WithAddress(std::vector<std::string> flags, bool metrics) {
  // What flags say goes before what is usual: an address of their own, for one.
  if (std::find(flags.begin(), flags.end(), "--address") == flags.end()) {
    flags.insert(flags.end(), {"--address", "127.0.0.1:0"});
  }
  if (metrics) {
    flags.insert(flags.end(), {"--metrics-address", "127.0.0.1:0"});
  }
  return flags;
}

// What the unit that is deployed sets: glibc reads how to keep memory there.
std::vector<std::string> EnvironmentOfUnit() {
  const std::string key = "Environment=";
  std::vector<std::string> environment;
  std::ifstream unit(HALFLIGHT_SYSTEMD_UNIT);
  for (std::string line; std::getline(unit, line);) {
    if (line.rfind(key, 0) == 0) {
      environment.push_back(line.substr(key.size()));
      Require(environment.back().find_first_of("\"' \\%") == std::string::npos,
              "one variable a line, without quotes: " + line);
    }
  }
  Require(!environment.empty(), "an environment in " HALFLIGHT_SYSTEMD_UNIT);
  return environment;
}

}  // namespace

Server::Server(const testing::Folder& folder, std::vector<std::string> flags,
               const std::string& program)
    : Process(folder, program, WithAddress(std::move(flags), HasMetrics(program)),
              {.environment = EnvironmentOfUnit()}),
      address_(Address()) {
  metrics_address_ = AfterKey(Err(), "metrics address=");
}

bool Server::Serves() const {
  return testing::Health(testing::NewChannel(address_), milliseconds(1000)) == testing::kServing;
}

double Server::Megabytes() const {
  std::ifstream file("/proc/" + std::to_string(pid()) + "/statm");
  double total = 0.0;
  double resident = 0.0;
  double shared = 0.0;
  file >> total >> resident >> shared;
  return (resident - shared) * 4096.0 / (1 << 20);
}

std::optional<double> Server::Metric(const std::string& name) const {
  const testing::ClientSocket client;
  if (metrics_address_.empty() || !client.Connect(metrics_address_)) {
    return std::nullopt;
  }
  client.Send("GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  std::string text;
  char bytes[4096];
  for (ssize_t got = 0; (got = recv(client.fd(), bytes, sizeof(bytes), 0)) > 0;) {
    text.append(bytes, static_cast<size_t>(got));
  }
  const std::string value = AfterKey(text, "\n" + name + " ");
  return value.empty() ? std::nullopt : std::optional(std::stod(value));
}

void Server::Rest() const {
  // Twice what main.cpp waits for calls, and a little for the giving back.
  std::this_thread::sleep_for(milliseconds(21000));
}

uint64_t Server::SetLimit(int resource, uint64_t value) const {
  rlimit before{};
  const auto which = static_cast<__rlimit_resource>(resource);
  Require(prlimit(pid(), which, nullptr, &before) == 0, "prlimit");
  rlimit changed = before;
  changed.rlim_cur = value;
  Require(prlimit(pid(), which, &changed, nullptr) == 0, "prlimit");
  return before.rlim_cur;
}

std::string GlRenderer() {
  const testing::Folder folder;
  const Server server(folder, {});
  auto client = client::Client::Connect(server.address());
  Require(client.status(), "connect");
  const auto info = client->GetServerInfo();
  Require(info.status(), "server info");
  return info->gl_renderer();
}

PeakMemory::PeakMemory(const Server& server)
    : peak_(server.Megabytes()), thread_([this, &server](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          peak_ = std::max(peak_.load(), server.Megabytes());
          std::this_thread::sleep_for(milliseconds(20));
        }
      }) {}

double PeakMemory::Stop() {
  thread_ = {};
  return peak_;
}

HealthProbe::HealthProbe(const std::string& address) : channel_(testing::NewChannel(address)) {
  Require(testing::Health(channel_) == testing::kServing, "health before the scenario");
  thread_ = std::jthread([this](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto begin = Clock::now();
      const testing::Answer answer = testing::CallRaw(channel_, "/grpc.health.v1.Health/Check", "");
      const std::chrono::duration<double, std::milli> wait = Clock::now() - begin;
      const bool well = answer.bytes == testing::kServing;
      if (!well) {
        std::cerr << "soak: health: " << answer.status.error_code() << " "
                  << answer.status.error_message() << std::endl;
      }
      waits_.push_back(well ? wait.count() : kNotServing);
      std::this_thread::sleep_for(milliseconds(5));
    }
  });
}

std::vector<double> HealthProbe::Stop() {
  thread_ = {};
  return std::move(waits_);
}

}  // namespace halflight::soak
