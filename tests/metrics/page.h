// A page of metrics as Prometheus reads it: fetched over plain HTTP, and looked up by name and
// labels.
#pragma once

#include <cstdlib>
#include <map>
#include <sstream>
#include <string>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <gtest/gtest.h>

#include "server/file_descriptor.h"

namespace halflight::testing {

// Sends bytes to "127.0.0.1:port" and returns all that comes back until the server hangs up, or for
// as long as a minute.
inline std::string Exchange(const std::string& address, const std::string& request) {
  const FileDescriptor client(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const timeval minute{.tv_sec = 60, .tv_usec = 0};
  setsockopt(client.get(), SOL_SOCKET, SO_RCVTIMEO, &minute, sizeof(minute));
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  name.sin_port =
      htons(static_cast<uint16_t>(std::atoi(address.substr(address.rfind(':') + 1).c_str())));
  if (connect(client.get(), reinterpret_cast<const sockaddr*>(&name), sizeof(name)) != 0) {
    return "";
  }
  send(client.get(), request.data(), request.size(), MSG_NOSIGNAL);
  std::string answer;
  char bytes[4096];
  for (ssize_t got = 0; (got = recv(client.get(), bytes, sizeof(bytes), 0)) > 0;) {
    answer.append(bytes, static_cast<size_t>(got));
  }
  return answer;
}

inline std::string Get(const std::string& address, const std::string& path) {
  return Exchange(address, "GET " + path + " HTTP/1.1\r\nHost: " + address + "\r\n\r\n");
}

class MetricsPage {
 public:
  static MetricsPage Fetch(const std::string& address) {
    const std::string answer = Get(address, "/metrics");
    EXPECT_EQ(answer.rfind("HTTP/1.1 200 OK\r\n", 0), 0U) << answer;
    return MetricsPage(answer.substr(answer.find("\r\n\r\n") + 4));
  }

  explicit MetricsPage(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      const size_t blank = line.rfind(' ');
      if (line.empty() || line[0] == '#') {
        continue;
      }
      EXPECT_NE(blank, std::string::npos) << line;
      EXPECT_TRUE(values_.emplace(line.substr(0, blank), std::atof(line.c_str() + blank)).second)
          << "twice: " << line;
    }
  }

  // Such as `halflight_calls_total{code="OK",rpc="RenderFrame"}`, labels in alphabetical order. 0
  // where it is not there.
  [[nodiscard]] double operator[](const std::string& series) const {
    const auto found = values_.find(series);
    return found == values_.end() ? 0.0 : found->second;
  }
  [[nodiscard]] bool Has(const std::string& series) const { return values_.count(series) != 0; }
  // Of all series of a metric.
  [[nodiscard]] double Sum(const std::string& metric) const {
    double sum = 0.0;
    for (auto at = values_.lower_bound(metric + "{");
         at != values_.end() && at->first.rfind(metric + "{", 0) == 0; ++at) {
      sum += at->second;
    }
    return sum;
  }
  [[nodiscard]] const std::map<std::string, double>& values() const { return values_; }

 private:
  std::map<std::string, double> values_;
};

}  // namespace halflight::testing
