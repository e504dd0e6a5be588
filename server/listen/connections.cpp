#include "server/listen/connections.h"

#include <sys/socket.h>

namespace halflight {
namespace {

constexpr std::chrono::milliseconds kLookAgain{5};

// 0 where it is no socket.
uint64_t CookieOf(int fd) {
  uint64_t cookie = 0;
  socklen_t length = sizeof(cookie);
  return getsockopt(fd, SOL_SOCKET, SO_COOKIE, &cookie, &length) == 0 ? cookie : 0;
}

}  // namespace

void Connections::Add(int fd) { cookies_[fd] = CookieOf(fd); }

bool Connections::AtLeast(size_t limit) {
  if (cookies_.size() < limit) {
    return false;
  }
  if (std::chrono::steady_clock::now() - looked_ < kLookAgain) {
    return true;
  }
  return Count() >= limit;
}

size_t Connections::Count() {
  std::erase_if(cookies_, [](const auto& entry) { return CookieOf(entry.first) != entry.second; });
  looked_ = std::chrono::steady_clock::now();
  return cookies_.size();
}

void Connections::HangUp() {
  Count();
  for (const auto& [fd, cookie] : cookies_) {
    shutdown(fd, SHUT_RD);
  }
}

}  // namespace halflight
