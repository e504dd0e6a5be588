// The page's first part: what to use.
#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "tests/measure/markdown.h"
#include "tests/report/page.h"

namespace halflight::report {
namespace {

using measure::kExact;
using measure::Limit;
using measure::Percent;
using measure::Row;
using measure::Rule;
using measure::Times;

constexpr std::array<double, 5> kWanted = {0.4, 0.2, 0.1, 0.05, 0.02};

class AdviceWriter {
 public:
  explicit AdviceWriter(const Results& results) : results_(results) {}

  std::string Write() {
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
        "## What to use\n\n"
        "- Knowing nothing of the scene: **%s**, `%s`. Error %s.\n"
        "- The baseline of all times is **%s**, classic half-angle slicing. Error "
        "%s in the median scene, %s in the worst.\n",
        SettingOf(advised).name, SettingOf(advised).flags, Words(advised),
        SettingOf(*baseline).name, Percent(baseline->median_error), Percent(baseline->worst_error));
    if (unsaid != nullptr) {
      absl::StrAppendFormat(
          &text_,
          "- Without flags a GPU draws **%s**, and a CPU the light sweep of degree 4. "
          "Error of the former %s.\n",
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
    return std::move(text_);
  }

 private:
  const Setting& SettingOf(const Summary& summary) const {
    return results_.settings[summary.setting];
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

  const Results& results_;
  std::string text_;
  std::set<size_t> explained_;  // settings named in the tables
};

}  // namespace

Summary Advised(const Results& results) {
  return BestInTimeOfBaseline(Summarize(results, [](const ReportScene&) { return true; }));
}

std::string WriteAdvice(const Results& results) { return AdviceWriter(results).Write(); }

}  // namespace halflight::report
