// The whole report: measures, sums up, draws, writes. Start reading here.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"

namespace halflight::report {

struct ReportOptions {
  std::string data_folder = "tests/data";
  std::string out_folder = "docs/report";
  std::string device = "auto";  // as RenderThreadOptions
  bool short_form = false;      // small frames, few settings: checks the tool, measures nothing
  int repeats = 5;              // of the matrix; the scaling part, three at most
  std::string version;
  std::string command;
  std::function<void(const std::string& what)> progress = [](const std::string&) {};
};

// Writes README.md, measurements.csv, plots and pictures into the folder, which is made where it is
// not there. Nothing is written before all is measured. NotFound for particles that cannot be read,
// PermissionDenied naming the file that cannot be written, else errors of the renderer.
absl::Status MakeReport(const ReportOptions& options);

}  // namespace halflight::report
