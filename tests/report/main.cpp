// halflight_report: flags, then the report. `./dev report` runs it.

#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

#include "absl/strings/str_cat.h"
#include "tests/report/report.h"

int main(int argc, char** argv) {
  halflight::report::ReportOptions options;
  std::string revision;
  CLI::App app("Measures speed against error, and writes it down as one page.", "halflight_report");
  app.add_option("--out", options.out_folder,
                 "Folder to write; default: docs/report, of the short form out/report");
  app.add_option("--data", options.data_folder, "Folder that holds plume/")->capture_default_str();
  app.add_option("--device", options.device, "As of halflightd")->capture_default_str();
  app.add_option("--repeats", options.repeats, "Timed turns")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_flag("--short", options.short_form, "Small and quick: checks the tool, measures nothing");
  app.add_option("--revision", revision, "Named on the page, beside the version");
  CLI11_PARSE(app, argc, argv);

  if (options.short_form && app.count("--out") == 0) options.out_folder = "out/report";
  options.version = HALFLIGHT_VERSION;
  if (!revision.empty()) absl::StrAppend(&options.version, " (", revision, ")");
  options.command = "./dev report";
  if (options.short_form) options.command += " --short";
  if (app.count("--repeats") > 0) absl::StrAppend(&options.command, " --repeats ", options.repeats);
  if (app.count("--device") > 0) absl::StrAppend(&options.command, " --device ", options.device);
  options.progress = [](const std::string& what) { std::cerr << "report: " << what << std::endl; };

  const absl::Status status = halflight::report::MakeReport(options);
  if (!status.ok()) {
    std::cerr << "report: " << status << "\n";
    return 1;
  }
  std::cout << options.out_folder << "/README.md\n";
  return 0;
}
