#include "tests/report/page.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "tests/measure/markdown.h"

namespace halflight::report {
namespace {

using measure::kExact;
using measure::Number;
using measure::Percent;
using measure::Row;
using measure::Rule;
using measure::Times;

class Writer {
 public:
  Writer(const Results& results, const std::vector<Example>& examples, const Making& making)
      : results_(results), examples_(examples), making_(making) {}

  std::string Write() {
    text_ = "# Speed against error\n\n";
    if (making_.short_form) {
      text_ +=
          "**Short form, to check the tool: frames too small and too few for figures that mean "
          "anything.**\n\n";
    }
    text_ += WriteAdvice(results_);
    WritePlots();
    WriteExamples();
    WriteScaling();
    WriteMaking();
    return text_;
  }

 private:
  const Setting& Baseline() const {
    return *std::find_if(results_.settings.begin(), results_.settings.end(),
                         [](const Setting& setting) { return setting.baseline; });
  }

  void WritePlots() {
    absl::StrAppend(
        &text_, "## Error against time\n\n",
        "Left and low is better. Filled marks on the broad line are the Pareto front: nothing "
        "measured is both faster and nearer. Numbers are slices, of the light sweep degrees.\n\n");
    for (const auto& [opacity, value] : Opacities()) {
      absl::StrAppendFormat(&text_, "![Error against time, %s smoke](error-%s.svg)\n\n", opacity,
                            opacity);
    }
  }

  void WriteExamples() {
    absl::StrAppend(&text_, "## What the errors look like\n\n",
                    "Error maps: blue is too dark, red too light, in parts of the mean.\n\n",
                    "![Colours of the error maps](error-scale.svg)\n\n");
    const Setting& advised = results_.settings[Advised(results_).setting];
    absl::StrAppend(&text_,
                    Row({"scene", "the model", Baseline().name + " (baseline)", "its error",
                         advised.name + " (advised)", "its error"}),
                    Rule(6));
    for (const Example& example : examples_) {
      const ReportScene& scene = results_.scenes[example.scene];
      std::vector<std::string> cells = {
          absl::StrFormat("%s, %s", scene.opacity, LightTitle(scene.light)),
          ImageCell(example.exact, "the model")};
      for (size_t i = 0; i < example.frames.size(); ++i) {
        cells.push_back(ImageCell(example.frames[i], "the frame"));
        cells.push_back(ImageCell(example.error_maps[i], "its error"));
      }
      absl::StrAppend(&text_, Row(cells));
    }
    absl::StrAppend(&text_, "\n");
  }

  static std::string ImageCell(const Picture& picture, const std::string& what) {
    return absl::StrCat("![", what, "](", picture.file, ")");
  }

  void WriteScaling() {
    absl::StrAppend(
        &text_, "## Cost against particles\n\n",
        "The plume in other numbers of particles: thinned out, or each particle several times, "
        "moved by up to half its radius; opacities keep the sum of optical depths. So the smoke "
        "stays, and the same pixels are covered by more layers.\n\n",
        "![Time against the number of particles](scaling.svg)\n\n");
    std::vector<std::string> head = {"particles"};
    for (const Setting& setting : results_.settings) {
      if (setting.scaling_most > 0) head.push_back(setting.name);
    }
    absl::StrAppend(&text_, Row(head), Rule(head.size()));
    for (size_t scene = 0; scene < results_.scenes.size(); ++scene) {
      if (results_.scenes[scene].part != Part::kScaling) continue;
      std::vector<std::string> cells = {
          absl::StrCat(results_.scenes[scene].scene.particles->size())};
      for (size_t setting = 0; setting < results_.settings.size(); ++setting) {
        if (results_.settings[setting].scaling_most == 0) continue;
        cells.push_back(ScalingCell(scene, setting));
      }
      absl::StrAppend(&text_, Row(cells));
    }
    absl::StrAppend(
        &text_, "\nTimes are multiples of the baseline's with ", ScalingBaseline(),
        " particles; errors are estimated from 1024 pixels, with its 95 % interval.\n\n");
  }

  std::string ScalingCell(size_t scene, size_t setting) const {
    for (const Measurement& m : results_.measurements) {
      if (m.scene != scene || m.setting != setting) continue;
      if (m.error.rmse < kExact) return absl::StrCat(Times(m.time_ratio), ", 0 %");
      return absl::StrFormat("%s, %s (%s to %s)", Times(m.time_ratio), Percent(m.error.rmse),
                             Number(m.error.rmse_low), Number(m.error.rmse_high));
    }
    return "not measured";
  }

  size_t ScalingBaseline() const {
    for (const ReportScene& scene : results_.scenes) {
      if (scene.scaling_baseline) return scene.scene.particles->size();
    }
    return 0;
  }

  void WriteMaking() {
    std::vector<std::string> names;
    std::vector<double> baseline_times;
    int repeats = 0;
    int scaling_repeats = 0;
    size_t fewest = SIZE_MAX;
    size_t most = 0;
    for (const ReportScene& scene : results_.scenes) {
      names.push_back(absl::StrCat("`", scene.name, "`"));
      if (scene.part != Part::kMatrix) continue;
      fewest = std::min(fewest, scene.scene.particles->size());
      most = std::max(most, scene.scene.particles->size());
    }
    for (const Measurement& m : results_.measurements) {
      const bool matrix = results_.scenes[m.scene].part == Part::kMatrix;
      (matrix ? repeats : scaling_repeats) = m.repeats;
      if (matrix && results_.settings[m.setting].baseline) baseline_times.push_back(m.milliseconds);
    }
    const auto [least, longest] = std::minmax_element(baseline_times.begin(), baseline_times.end());
    const Camera& camera = results_.scenes.front().scene.camera;
    absl::StrAppend(&text_, "## How this page was made\n\n");
    const auto add = [&](const std::string& what, const std::string& value) {
      absl::StrAppend(&text_, "- ", what, ": ", value, "\n");
    };
    add("Command", absl::StrCat("`", making_.command, "`, ", making_.date));
    add("Version", making_.version);
    add("Machine", absl::StrCat(making_.cpu, ", ", making_.cores, " cores"));
    add("GL renderer", absl::StrCat(making_.gl_renderer, "; OpenGL ", making_.gl_version));
    add("Time",
        absl::StrFormat("from request to pixels in memory, without encoding; frames drawn in turns "
                        "after one to warm up, each of particles never drawn before; the median of "
                        "%d ratios to the baseline in the same "
                        "turn, of %d against the number of particles. The baseline took %.0f to "
                        "%.0f ms a frame",
                        repeats, scaling_repeats, *least, *longest));
    add("Frames", absl::StrFormat("%d x %d pixels; %d to %d particles in the matrix", camera.width,
                                  camera.height, fewest, most));
    add("Scenes", absl::StrJoin(names, ", "));
    add("Every measurement, with bias, 99.9th percentile and maximum",
        "[measurements.csv](measurements.csv)");
  }

  const Results& results_;
  const std::vector<Example>& examples_;
  const Making& making_;
  std::string text_;
};

}  // namespace

std::string WritePage(const Results& results, const std::vector<Example>& examples,
                      const Making& making) {
  return Writer(results, examples, making).Write();
}

}  // namespace halflight::report
