#include "tests/report/report.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "renderer/frame_renderer.h"
#include "tests/measure/machine.h"
#include "tests/report/csv.h"
#include "tests/report/examples.h"
#include "tests/report/measure.h"
#include "tests/report/page.h"
#include "tests/report/plots.h"

namespace halflight::report {
namespace {

absl::Status WriteFile(const std::string& folder, const std::string& name,
                       const std::string& bytes) {
  const std::string path = absl::StrCat(folder, "/", name);
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  file.close();
  if (!file) return absl::PermissionDeniedError(absl::StrCat("out: cannot write ", path));
  return absl::OkStatus();
}

size_t BaselineOf(const Results& results) {
  const auto baseline = std::find_if(results.settings.begin(), results.settings.end(),
                                     [](const Setting& setting) { return setting.baseline; });
  return static_cast<size_t>(baseline - results.settings.begin());
}

}  // namespace

absl::Status MakeReport(const ReportOptions& options) {
  constexpr int kMostScalingRepeats = 3;
  std::error_code error;
  std::filesystem::create_directories(options.out_folder, error);
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat("out: cannot make ", options.out_folder, ": ", error.message()));
  }
  absl::StatusOr<std::vector<ReportScene>> scenes =
      LoadScenes({options.data_folder, options.short_form});
  if (!scenes.ok()) return scenes.status();
  const auto renderer = FrameRenderer::Create(options.device);
  if (!renderer.ok()) return renderer.status();

  // Measure.
  const absl::StatusOr<Results> results = MeasureAll(
      **renderer, *std::move(scenes), ListSettings(options.short_form),
      {options.repeats, std::min(options.repeats, kMostScalingRepeats), options.progress});
  if (!results.ok()) return results.status();

  // Draw what is shown.
  options.progress("examples");
  const absl::StatusOr<std::vector<Example>> examples =
      DrawExamples(**renderer, *results, {BaselineOf(*results), Advised(*results).setting});
  if (!examples.ok()) return examples.status();
  const DeviceInfo& device = (*renderer)->device();
  const Making making{.cpu = measure::CpuModel(),
                      .cores = std::thread::hardware_concurrency(),
                      .gl_renderer = device.gl_renderer,
                      .gl_version = device.gl_version,
                      .version = options.version,
                      .date = measure::Today(),
                      .command = options.command,
                      .short_form = options.short_form};

  // Write it down.
  std::vector<std::pair<std::string, std::string>> files = {
      {"README.md", WritePage(*results, *examples, making)},
      {"measurements.csv", WriteCsv(*results)},
      {"scaling.svg", PlotScaling(*results)},
      {"error-scale.svg", PlotErrorScale()}};
  for (const auto& [opacity, value] : Opacities()) {
    files.emplace_back(absl::StrCat("error-", opacity, ".svg"),
                       PlotErrorAgainstTime(*results, opacity));
  }
  for (const Example& example : *examples) {
    files.emplace_back(example.exact.file, example.exact.png);
    for (const Picture& frame : example.frames) files.emplace_back(frame.file, frame.png);
    for (const Picture& map : example.error_maps) files.emplace_back(map.file, map.png);
  }
  for (const auto& [name, bytes] : files) {
    if (absl::Status status = WriteFile(options.out_folder, name, bytes); !status.ok()) {
      return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace halflight::report
