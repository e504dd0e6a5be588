#include "server/metrics/metrics_server.h"

#include <chrono>
#include <string_view>
#include <utility>

#include <poll.h>
#include <sys/socket.h>

#include <fmt/format.h>

#include "server/file_descriptor.h"
#include "server/listen/acceptor.h"
#include "server/log/log.h"
#include "server/worker_pool.h"

namespace halflight {
namespace {

using Clock = std::chrono::steady_clock;

// Scrapers come one at a time, every few seconds.
constexpr uint32_t kMaxConnections = 16;
constexpr int kThreads = 2;
constexpr size_t kMaxRequestBytes = 8192;
constexpr std::chrono::seconds kLeastToSend{1};  // who waited for others has little time left

// False where nothing happens until then, or the peer is gone.
bool WaitFor(int fd, short event, Clock::time_point until) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
  pollfd polled{.fd = fd, .events = event, .revents = 0};
  return left.count() > 0 && poll(&polled, 1, static_cast<int>(left.count())) > 0;
}

// The head of a request, with its empty line; empty where none comes.
std::string ReadHead(int fd, Clock::time_point until) {
  std::string head;
  while (head.find("\r\n\r\n") == std::string::npos) {
    char bytes[1024];
    if (head.size() > kMaxRequestBytes || !WaitFor(fd, POLLIN, until)) {
      return "";
    }
    const ssize_t got = recv(fd, bytes, sizeof(bytes), 0);
    if (got <= 0) {
      return "";
    }
    head.append(bytes, static_cast<size_t>(got));
  }
  return head;
}

void Send(int fd, std::string_view bytes, Clock::time_point until) {
  while (!bytes.empty() && WaitFor(fd, POLLOUT, until)) {
    const ssize_t sent = send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0) {
      return;
    }
    bytes.remove_prefix(static_cast<size_t>(sent));
  }
}

std::string Answer(std::string_view status, std::string_view body, bool with_body = true) {
  return fmt::format(
      "HTTP/1.1 {}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n"
      "Content-Length: {}\r\nConnection: close\r\n\r\n{}",
      status, body.size(), with_body ? body : "");
}

std::string AnswerTo(std::string_view head, const MetricsServer::Page& page) {
  const std::string_view line = head.substr(0, head.find('\r'));
  const size_t method_end = line.find(' ');
  if (method_end == std::string_view::npos) {
    return Answer("400 Bad Request", "no HTTP\n");
  }
  const std::string_view method = line.substr(0, method_end);
  const std::string_view target = line.substr(method_end + 1);
  const std::string_view path = target.substr(0, target.find_first_of(" ?"));
  if (method != "GET" && method != "HEAD") {
    return Answer("405 Method Not Allowed", "allowed: GET\n");
  }
  if (path != "/metrics") {
    return Answer("404 Not Found", "allowed: /metrics\n");
  }
  return Answer("200 OK", page(), method == "GET");
}

class Server final : public MetricsServer {
 public:
  Server(Page page, std::chrono::seconds patience) : page_(std::move(page)), patience_(patience) {}
  ~Server() override {
    acceptor_.reset();
    connections_.CutOff();
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  absl::Status Listen(std::vector<ListeningSocket> sockets) {
    auto acceptor =
        Acceptor::Start(std::move(sockets), connections_,
                        {.all = kMaxConnections, .one_machine = kMaxConnections}, [this](int fd) {
                          // From now on, so that who says nothing keeps those behind it waiting no
                          // longer than itself.
                          const auto until = Clock::now() + patience_;
                          // Tasks can be copied, descriptors that close themselves cannot.
                          workers_.Post([this, until, kept = std::make_shared<FileDescriptor>(fd)] {
                            Serve(kept->get(), until);
                          });
                        });
    if (!acceptor.ok()) {
      return acceptor.status();
    }
    acceptor_ = *std::move(acceptor);
    return absl::OkStatus();
  }

 private:
  void Serve(int fd, Clock::time_point until) {
    if (const std::string head = ReadHead(fd, until); !head.empty()) {
      const std::string answer = AnswerTo(head, page_);
      Send(fd, answer, std::max(until, Clock::now() + kLeastToSend));
    }
  }

  const Page page_;
  const std::chrono::seconds patience_;
  Connections connections_;
  WorkerPool workers_{kThreads};
  std::unique_ptr<Acceptor> acceptor_;
};

}  // namespace

absl::StatusOr<std::vector<ListeningSocket>> BindMetricsAddress(const MetricsOptions& options) {
  std::vector<ListeningSocket> sockets;
  if (options.address.empty()) {
    return sockets;
  }
  auto bound = ListeningSocket::Bind(options.address, "--metrics-address");
  if (!bound.ok()) {
    return bound.status();
  }
  for (const ListeningSocket& socket : *bound) {
    if (socket.local()) {
      continue;
    }
    if (!options.insecure) {
      return absl::InvalidArgumentError(fmt::format(
          "--metrics-address: {}: others than this machine could read metrics, tenants' names "
          "among "
          "them; allowed: loopback addresses and unix sockets, or all with --insecure-metrics",
          socket.address()));
    }
    Log(LogLevel::kWarn, "insecure_metrics",
        {{"address", socket.address()}, {"message", "others than this machine can read metrics"}});
  }
  return *std::move(bound);
}

absl::StatusOr<std::unique_ptr<MetricsServer>> MetricsServer::Start(
    std::vector<ListeningSocket> sockets, Page page, std::chrono::seconds patience) {
  auto server = std::make_unique<Server>(std::move(page), patience);
  if (absl::Status status = server->Listen(std::move(sockets)); !status.ok()) {
    return status;
  }
  return server;
}

}  // namespace halflight
