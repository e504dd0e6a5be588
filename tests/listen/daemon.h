// halflightd with a fake engine as a process, and what its tests ask of it.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/client.h"
#include "tests/access/health.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/server/fake_engine.h"

namespace halflight::testing {

// HALFLIGHT_LONG_TESTS asks for the sizes and the times that docs/operations.md promises; without
// it a few seconds have to do, and times, which belong to an idle machine, are only told.
inline bool LongTests() { return std::getenv("HALFLIGHT_LONG_TESTS") != nullptr; }

class Daemon : public Process {
 public:
  explicit Daemon(const Folder& folder, std::vector<std::string> arguments = {},
                  ProcessOptions options = {})
      : Process(folder, "halflightd_fake", WithAddress(std::move(arguments)), std::move(options)) {}

 private:
  static std::vector<std::string> WithAddress(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--address", "127.0.0.1:0"});
    return arguments;
  }
};

}  // namespace halflight::testing
