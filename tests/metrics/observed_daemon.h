// halflightd with a fake engine and two tenants, as a process that shows its metrics.
#pragma once

#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "halflight/sha256.h"
#include "tests/metrics/caller.h"
#include "tests/metrics/page.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"

namespace halflight::testing {

class ObservedDaemon : public ::testing::Test {
 protected:
  void Start(std::vector<std::string> more) {
    const std::string tokens =
        folder_.Write("tokens", ToHex(Sha256Of("alice's token")) + " alice\n" +
                                    ToHex(Sha256Of("bob's token")) + " bob\n");
    std::vector<std::string> flags = {"--address",   "127.0.0.1:0",   "--metrics-address",
                                      "127.0.0.1:0", "--token-file",  tokens,
                                      "--device",    folder_ / "hold"};
    flags.insert(flags.end(), more.begin(), more.end());
    server_.emplace(folder_, "halflightd_fake", flags);
    ASSERT_TRUE(WaitFor([this] { return AddressAfter("listening") != ""; })) << server_->Err();
    address_ = AddressAfter("listening");
    metrics_address_ = AddressAfter("metrics");
  }

  // What the log says, in either of its forms, of the event that has an address.
  [[nodiscard]] std::string AddressAfter(const std::string& event) const {
    const std::string log = server_->Err();
    for (const auto& [before, after] : {std::pair(" " + event + " address=", "\n"),
                                        std::pair("\"" + event + "\",\"address\":\"", "\"")}) {
      const size_t at = log.find(before);
      const size_t end = at == std::string::npos ? at : log.find(after, at + before.size());
      if (end != std::string::npos) {
        return log.substr(at + before.size(), end - at - before.size());
      }
    }
    return "";
  }

  [[nodiscard]] MetricsPage Page() const { return MetricsPage::Fetch(metrics_address_); }
  // Whether the series comes to the value.
  [[nodiscard]] bool Becomes(const std::string& series, double value) const {
    return WaitFor([&] { return Page()[series] == value; });
  }

  // While they are held, frames wait in the engine.
  void Hold() const { [[maybe_unused]] const auto held = folder_.Write("hold", ""); }
  void LetGo() const { std::filesystem::remove(folder_ / "hold"); }

  TestCaller Alice() const { return {address_, "alice's token"}; }
  TestCaller Bob() const { return {address_, "bob's token"}; }
  TestCaller Stranger() const { return {address_, ""}; }

  const Folder folder_;
  std::optional<Process> server_;
  std::string address_;
  std::string metrics_address_;
};

}  // namespace halflight::testing
