// Certificates of a moment, for tests of who gets in.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace halflight::testing {

// A certificate and its key, PEM.
struct Issued {
  std::string certificate;
  std::string key;
};

struct Subject {
  std::string common_name{};             // empty: none
  std::vector<std::string> alternate{};  // as OpenSSL writes them: "DNS:a", "IP:127.0.0.1", "URI:x"
  // From now; both in the past is an expired one.
  int valid_from_seconds = -3600;
  int valid_until_seconds = 3600;
  bool weak = false;  // a key of RSA of 1024 bits
};

class Authority {
 public:
  Authority();
  ~Authority();
  Authority(const Authority&) = delete;
  Authority& operator=(const Authority&) = delete;

  [[nodiscard]] const std::string& certificate() const { return certificate_; }
  [[nodiscard]] Issued Issue(const Subject& subject) const;
  // For localhost and 127.0.0.1.
  [[nodiscard]] Issued IssueServer() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::string certificate_;
};

}  // namespace halflight::testing
