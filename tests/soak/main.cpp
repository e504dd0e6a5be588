// halflight_soak: the service under faults and load, scenario by scenario (docs/reliability.md).

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include "tests/measure/machine.h"
#include "tests/soak/page.h"
#include "tests/soak/scenario.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

struct Options {
  bool short_form = false;
  bool sabotage = false;
  bool list = false;
  std::vector<std::string> only;
  std::string page;
  std::string revision;
};

std::vector<Row> RowsOf(const Scenario& scenario, const Options& options) {
  // Sabotage shows in times too, and by far.
  Report report(options.sabotage || !options.short_form);
  Run run{.report = report,
          .short_form = options.short_form || options.sabotage,
          .sabotage = options.sabotage};
  try {
    scenario.run(run);
  } catch (const std::exception& error) {
    report.Holds("ran to its end", false, error.what());
  }
  return report.rows();
}

// Whether each property was missed that sabotage must make it miss.
bool Missed(const Scenario& scenario, const std::vector<Row>& rows) {
  bool all = true;
  for (const std::string_view property : scenario.missed) {
    const bool missed = std::any_of(rows.begin(), rows.end(), [&](const Row& row) {
      return !row.ok && row.property.rfind(property, 0) == 0;
    });
    if (!missed) {
      std::cerr << "soak: " << scenario.name << ": not missed under sabotage: " << property << "\n";
    }
    all = all && missed;
  }
  return all;
}

// What else the machine did while `begin` was not long ago: part of all cores.
std::string Others(const measure::CpuSeconds& begin, std::chrono::steady_clock::time_point since) {
  const measure::CpuSeconds end = measure::CpuSecondsSoFar();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - since;
  const double others = (end.all - begin.all) - (end.own - begin.own);
  return fmt::format(
      "{:.0f} % of the cores' time went to other programs",
      100.0 * std::max(0.0, others) / (elapsed.count() * std::thread::hardware_concurrency()));
}

bool RunOne(const Scenario& scenario, const Options& options) {
  const std::string renderer = options.page.empty() ? "" : GlRenderer();
  std::cerr << "soak: " << scenario.name << (options.sabotage ? ", sabotaged" : "") << std::endl;
  const measure::CpuSeconds cpu = measure::CpuSecondsSoFar();
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<Row> rows = RowsOf(scenario, options);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const std::string others = Others(cpu, begin);
  for (const Row& row : rows) {
    std::cout << LineOf(std::string(scenario.name), row) << "\n";
  }
  std::cout << fmt::format("| {} | took | {:.1f} s | told | |\n", scenario.name, took.count());
  std::cout.flush();
  if (options.sabotage) {
    return Missed(scenario, rows);
  }
  if (!options.page.empty()) {
    const absl::Status status =
        PutOnPage(options.page,
                  {.scenario = std::string(scenario.name),
                   .what = std::string(scenario.what),
                   .sabotage = std::string(scenario.sabotage),
                   .rows = rows,
                   .made = fmt::format(
                       "{} of revision {} in {} s, in which {}; {}, {} cores; GL renderer {}",
                       measure::Today(), options.revision, Digits(std::round(took.count())), others,
                       measure::CpuModel(), std::thread::hardware_concurrency(), renderer)});
    if (!status.ok()) {
      std::cerr << "soak: " << status << "\n";
      return false;
    }
  }
  return std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row.ok; });
}

// In a process of its own: what one scenario leaves, such as gRPC's threads and their scheduling,
// is none of the next one's affair. Nothing here has used gRPC or made a thread before.
bool RunApart(const Scenario& scenario, const Options& options) {
  const pid_t pid = fork();
  if (pid == 0) {
    std::exit(RunOne(scenario, options) ? 0 : 1);
  }
  int status = 0;
  return pid > 0 && waitpid(pid, &status, 0) == pid && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

int Main(const Options& options) {
  if (options.list) {
    for (const Scenario& scenario : Scenarios()) {
      std::cout << scenario.name << ": " << scenario.what << "\n";
    }
    return 0;
  }
  std::vector<const Scenario*> wanted;
  for (const Scenario& scenario : Scenarios()) {
    if (options.only.empty() ||
        std::find(options.only.begin(), options.only.end(), scenario.name) != options.only.end()) {
      wanted.push_back(&scenario);
    }
  }
  if (wanted.empty() || wanted.size() < options.only.size()) {
    std::cerr << "soak: --only: no such scenario, allowed: those of --list\n";
    return 2;
  }
  bool all = true;
  if (wanted.size() == 1) {
    all = RunOne(*wanted.front(), options);
  } else {
    for (const Scenario* scenario : wanted) {
      all = RunApart(*scenario, options) && all;
    }
  }
  return all ? 0 : 1;
}

}  // namespace
}  // namespace halflight::soak

int main(int argc, char** argv) {
  // What the tests' own classes expect ends the scenario that it fails in.
  GTEST_FLAG_SET(throw_on_failure, true);
  int no_arguments = 1;
  testing::InitGoogleTest(&no_arguments, argv);
  halflight::soak::Options options;
  CLI::App app("Holds halflightd to its promises under faults and load", "halflight_soak");
  app.add_flag("--short", options.short_form, "Seconds in place of minutes; times are told only");
  app.add_flag("--sabotage", options.sabotage,
               "Against servers without the protection that each scenario is about: fails unless "
               "each scenario misses its bounds");
  app.add_flag("--list", options.list, "List the scenarios");
  app.add_option("--only", options.only, "Run this scenario; may be given several times");
  app.add_option("--page", options.page, "Page that the figures are put on");
  app.add_option("--revision", options.revision, "Named on the page");
  CLI11_PARSE(app, argc, argv);
  return halflight::soak::Main(options);
}
