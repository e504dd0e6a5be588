#include "tests/bench/program.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <thread>

#include <CLI/CLI.hpp>

#include "absl/strings/str_cat.h"
#include "renderer/frame_renderer.h"
#include "renderer/kept_memory.h"
#include "tests/bench/figures.h"
#include "tests/bench/goals.h"
#include "tests/bench/page.h"
#include "tests/measure/machine.h"

namespace halflight::bench {
namespace {

struct ProgramOptions {
  MeasureOptions measure;
  std::string page = "docs/benchmark.md";
  std::string figures = "out/bench/figures.json";
  Making making;
};

absl::Status WriteFile(const std::string& path, const std::string& bytes) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  file.close();
  if (!file) return absl::PermissionDeniedError(absl::StrCat("cannot write ", path));
  return absl::OkStatus();
}

absl::Status Measure(ProgramOptions options, const ServicePart& service) {
  const measure::CpuSeconds cpu_begin = measure::CpuSecondsSoFar();
  const auto begin = std::chrono::steady_clock::now();
  const auto renderer = FrameRenderer::Create(options.measure.device);
  if (!renderer.ok()) return renderer.status();
  const DeviceInfo& device = (*renderer)->device();
  if (!device.software) options.measure.device_sizes = true;
  options.making.cpu = measure::CpuModel();
  options.making.cores = std::thread::hardware_concurrency();
  options.making.gl_renderer = device.gl_renderer;
  options.making.gl_version = device.gl_version;
  options.making.date = measure::Today();
  options.making.short_form = options.measure.short_form;

  absl::StatusOr<Results> results = MeasureAll(**renderer, options.measure);
  if (!results.ok()) return results.status();
  results->goals = JudgeRenderer(*results);
  if (service) {
    options.measure.progress("service");
    if (absl::Status status = service(**renderer, options.measure, *results); !status.ok())
      return status;
  }
  const measure::CpuSeconds cpu_end = measure::CpuSecondsSoFar();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  const double others = (cpu_end.all - cpu_begin.all) - (cpu_end.own - cpu_begin.own);
  options.making.others = std::max(0.0, others / (elapsed.count() * options.making.cores));

  absl::Status status = WriteFile(options.figures, WriteFigures(*results, options.making));
  if (status.ok()) status = WriteFile(options.page, WritePage(*results, options.making));
  return status;
}

}  // namespace

int RunProgram(int argc, char** argv, const ServicePart& service) {
  KeepFreedMemory();  // as halflightd does
  ProgramOptions options;
  std::string revision;
  bool gpu = false;
  CLI::App app("Measures what a frame costs, against its error, in one run.", "halflight_bench");
  const CLI::Option* const page = app.add_option(
      "--page", options.page, "File to write; default: docs/benchmark.md, --short out/bench/");
  app.add_option("--figures", options.figures, "All figures, as JSON")->capture_default_str();
  app.add_option("--data", options.measure.data_folder, "Folder that holds plume/")
      ->capture_default_str();
  const CLI::Option* const device =
      app.add_option("--device", options.measure.device, "As of halflightd")->capture_default_str();
  const CLI::Option* const repeats =
      app.add_option("--repeats", options.measure.repeats, "Timed turns of one frame, at most")
          ->check(CLI::Range(1, 1000))
          ->capture_default_str();
  app.add_flag("--short", options.measure.short_form,
               "Small and quick: checks the tool, measures nothing");
  app.add_flag("--gpu", gpu, "Sizes for a GPU too; on one they are measured anyway");
  app.add_option("--revision", revision, "Named on the page, beside the version");
  CLI11_PARSE(app, argc, argv);

  const bool short_form = options.measure.short_form;
  if (short_form && page->count() == 0) options.page = "out/bench/benchmark.md";
  options.measure.device_sizes = gpu;
  options.measure.progress = [](const std::string& what) {
    std::cerr << "bench: " << what << std::endl;
  };
  options.making.version = HALFLIGHT_VERSION;
  if (!revision.empty()) absl::StrAppend(&options.making.version, " (", revision, ")");
  absl::StrAppend(&options.making.command, "./dev bench", short_form ? " --short" : "",
                  gpu ? " --gpu" : "");
  if (repeats->count() > 0) {
    absl::StrAppend(&options.making.command, " --repeats ", options.measure.repeats);
  }
  if (device->count() > 0)
    absl::StrAppend(&options.making.command, " --device ", options.measure.device);

  const absl::Status status = Measure(options, service);
  if (!status.ok()) {
    std::cerr << "bench: " << status << "\n";
    return 1;
  }
  std::cout << options.page << "\n" << options.figures << "\n";
  return 0;
}

}  // namespace halflight::bench
