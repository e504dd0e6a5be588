#include "tests/report/page.h"

#include <algorithm>
#include <array>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

namespace halflight::report {
namespace {

// In percent, with two digits.
std::string Number(double value) {
  if (value < 5e-5) return "0";
  const double percent = 100.0 * value;
  if (percent < 0.995) return absl::StrFormat("%.2f", percent);
  return percent < 9.95 ? absl::StrFormat("%.1f", percent) : absl::StrFormat("%.0f", percent);
}

std::string Percent(double value) { return absl::StrCat(Number(value), " %"); }

// Of a limit, which is a round number.
std::string Limit(double value) { return absl::StrFormat("%g %%", 100.0 * value); }

std::string Times(double ratio) {
  if (ratio < 0.995) return absl::StrFormat("%.2f\u00d7", ratio);
  return ratio < 9.95 ? absl::StrFormat("%.1f\u00d7", ratio) : absl::StrFormat("%.0f\u00d7", ratio);
}

std::string Row(const std::vector<std::string>& cells) {
  return absl::StrCat("| ", absl::StrJoin(cells, " | "), " |\n");
}

std::string Rule(size_t columns) {
  return absl::StrCat("|", absl::StrJoin(std::vector<std::string>(columns, "---"), "|"), "|\n");
}

class Writer {
 public:
  Writer(const Results& results, const std::vector<Example>& examples, const Making& making)
      : results_(results), examples_(examples), making_(making) {}

  std::string Write() {
    WriteAdvice();
    WritePlots();
    WriteExamples();
    WriteScaling();
    WriteMaking();
    return text_;
  }

 private:
  const Setting& SettingOf(const Summary& summary) const {
    return results_.settings[summary.setting];
  }

  const Setting& Baseline() const {
    return *std::find_if(results_.settings.begin(), results_.settings.end(),
                         [](const Setting& setting) { return setting.baseline; });
  }

  // "64 plain: 12 %, 0.5x", and remembers to explain the setting.
  std::string Cell(const Summary& summary) {
    explained_.insert(summary.setting);
    return absl::StrFormat("**%s**: %s, %s", SettingOf(summary).name, Percent(summary.worst_error),
                           Times(summary.time_ratio));
  }

  std::string WithinCell(const std::vector<Summary>& summaries, double error) {
    const std::optional<Summary> cheapest = CheapestWithin(summaries, error);
    return cheapest ? Cell(*cheapest) : "nothing measured";
  }

  std::vector<Summary> Of(const std::string& opacity, const std::string& light = "") const {
    return Summarize(results_, [&](const ReportScene& scene) {
      return (opacity.empty() || scene.opacity == opacity) &&
             (light.empty() || scene.light == light);
    });
  }

  // The summary of the first setting that `is_it` holds for.
  template <typename Predicate>
  static const Summary* Find(const std::vector<Summary>& summaries, const Predicate& is_it) {
    const auto found = std::find_if(summaries.begin(), summaries.end(), is_it);
    return found == summaries.end() ? nullptr : &*found;
  }

  std::string Words(const Summary& summary) {
    return absl::StrFormat("%s in the median scene, %s in the worst, %s the baseline's time",
                           Percent(summary.median_error), Percent(summary.worst_error),
                           Times(summary.time_ratio));
  }

  void WriteAdvice() {
    const std::vector<Summary> all = Of("");
    const Summary advised = Advised(results_);
    const Summary* baseline =
        Find(all, [&](const Summary& summary) { return SettingOf(summary).baseline; });
    const Summary* unsaid =
        Find(all, [&](const Summary& summary) { return IsDefault(SettingOf(summary)); });
    explained_.insert(advised.setting);
    explained_.insert(baseline->setting);
    absl::StrAppendFormat(
        &text_,
        "# Speed against error\n\n## What to use\n\n"
        "- Knowing nothing of the scene: **%s**, `%s`. Error %s.\n"
        "- The baseline of all times is **%s**, classic half-angle slicing. Error "
        "%s in the median scene, %s in the worst.\n",
        SettingOf(advised).name, SettingOf(advised).flags, Words(advised), Baseline().name,
        Percent(baseline->median_error), Percent(baseline->worst_error));
    if (unsaid != nullptr) {
      absl::StrAppendFormat(&text_, "- Without flags **%s** is drawn. Error %s.\n",
                            SettingOf(*unsaid).name, Words(*unsaid));
      explained_.insert(unsaid->setting);
    }
    absl::StrAppend(
        &text_,
        "\nOtherwise the cheapest setting that does what is wanted in every scene, with "
        "the error in the worst of them and the time:\n\n");
    WriteWants();
    absl::StrAppend(
        &text_,
        "\nBy the angle between the light and the view (0\u00b0 shines from the camera, "
        "180\u00b0 into it):\n\n");
    WriteDirections();
    absl::StrAppend(&text_, "\nThese settings as flags of `halflight render`:\n\n",
                    Row({"setting", "flags"}), Rule(2));
    for (const size_t setting : explained_) {
      absl::StrAppend(&text_, Row({results_.settings[setting].name,
                                   absl::StrCat("`", results_.settings[setting].flags, "`")}));
    }
    absl::StrAppend(
        &text_,
        "\nError is the root mean square of the difference to the [image model](../image-model.md) "
        "in linear R, G and B, over the pixels with coverage above 0.01, divided by the model's "
        "mean "
        "over them. Opacity of a particle: ",
        absl::StrJoin(Opacities(), ", ",
                      [](std::string* out, const std::pair<std::string, float>& opacity) {
                        absl::StrAppendFormat(out, "%s %g", opacity.first, opacity.second);
                      }),
        ".\n\n");
  }

  // What is drawn where a request says nothing.
  static bool IsDefault(const Setting& setting) {
    const ShadowSettings unsaid;
    return setting.shadow.technique == unsaid.technique && setting.shadow.slices == unsaid.slices &&
           setting.shadow.interpolate == unsaid.interpolate &&
           setting.shadow.light_buffer_size == unsaid.light_buffer_size &&
           setting.sampling.downsample == Sampling{}.downsample;
  }

  // Wants that are answered alike share a row.
  void WriteWants() {
    const std::array<std::vector<Summary>, 3> groups = {Of(""), Of("dense"), Of("thin")};
    std::vector<std::pair<std::string, std::vector<std::string>>> rows;
    const auto add = [&](const std::string& want, const auto& answer) {
      std::vector<std::string> cells;
      for (const std::vector<Summary>& group : groups) cells.push_back(answer(group));
      if (!rows.empty() && rows.back().second == cells) {
        absl::StrAppend(&rows.back().first, ", ", want);
      } else {
        rows.emplace_back(want, std::move(cells));
      }
    };
    add("the fastest", [&](const auto& group) { return Cell(Fastest(group)); });
    add("the most accurate in the baseline's time",
        [&](const auto& group) { return Cell(BestInTimeOfBaseline(group)); });
    for (const double error : kWanted) {
      add(absl::StrCat("error within ", Limit(error)),
          [&](const auto& group) { return WithinCell(group, error); });
    }
    add("the model itself", [&](const auto& group) { return WithinCell(group, kExact); });
    absl::StrAppend(&text_, Row({"you want", "any smoke", "dense smoke", "thin smoke"}), Rule(4));
    for (auto& [want, cells] : rows) {
      cells.insert(cells.begin(), want);
      absl::StrAppend(&text_, Row(cells));
    }
  }

  void WriteDirections() {
    std::vector<std::string> head = {"light"};
    for (const double error : kWanted) head.push_back(absl::StrCat("within ", Limit(error)));
    absl::StrAppend(&text_, Row(head), Rule(head.size()));
    for (const auto& [opacity, value] : Opacities()) {
      for (const std::string& light : LightNames()) {
        const std::vector<Summary> summaries = Of(opacity, light);
        if (summaries.empty()) continue;
        std::vector<std::string> cells = {absl::StrFormat("%s, %s", opacity, LightTitle(light))};
        std::string last;
        for (const double error : kWanted) {
          const std::string cell = WithinCell(summaries, error);
          cells.push_back(cell == last ? "as left" : cell);
          last = cell;
        }
        absl::StrAppend(&text_, Row(cells));
      }
    }
  }

  static std::string LightTitle(const std::string& light) {
    return absl::StrFormat("%s (%.0f\u00b0)", light == "90 degrees" ? "side" : light,
                           DegreesFromView(light));
  }

  void WritePlots() {
    absl::StrAppend(
        &text_, "## Error against time\n\n",
        "Left and low is better. Filled marks on the broad line are the Pareto front: nothing "
        "measured is both faster and nearer. Numbers are slices.\n\n");
    for (const auto& [opacity, value] : Opacities()) {
      absl::StrAppendFormat(&text_, "![Error against time, %s smoke](error-%s.svg)\n\n", opacity,
                            opacity);
    }
  }

  void WriteExamples() {
    absl::StrAppend(&text_, "## What the errors look like\n\n",
                    "Error maps: blue is too dark, red too light, in parts of the mean.\n\n",
                    "![Colours of the error maps](error-scale.svg)\n\n");
    const Setting& advised = SettingOf(Advised(results_));
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
                        "after one to warm up; the median of %d ratios to the baseline in the same "
                        "turn, of %d against the number of particles. The baseline took %.0f to "
                        "%.0f ms a frame",
                        repeats, scaling_repeats, *least, *longest));
    add("Frames", absl::StrFormat("%d x %d pixels; %d to %d particles in the matrix", camera.width,
                                  camera.height, fewest, most));
    add("Scenes", absl::StrJoin(names, ", "));
    add("Every measurement, with bias, 99.9th percentile and maximum",
        "[measurements.csv](measurements.csv)");
  }

  static constexpr std::array<double, 5> kWanted = {0.4, 0.2, 0.1, 0.05, 0.02};
  static constexpr double kExact = 1e-6;  // rounding alone

  const Results& results_;
  const std::vector<Example>& examples_;
  const Making& making_;
  std::string text_;
  std::set<size_t> explained_;  // settings named in the tables
};

}  // namespace

Summary Advised(const Results& results) {
  return BestInTimeOfBaseline(Summarize(results, [](const ReportScene&) { return true; }));
}

std::string WritePage(const Results& results, const std::vector<Example>& examples,
                      const Making& making) {
  return Writer(results, examples, making).Write();
}

}  // namespace halflight::report
