#include "tests/bench/page.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "tests/bench/goals.h"
#include "tests/measure/markdown.h"
#include "tests/measure/timing.h"

namespace halflight::bench {
namespace {

using measure::Number;
using measure::Percent;
using measure::Rule;
using measure::Times;

// Of the cores, what other programs may take where figures are to mean anything.
constexpr double kIdle = 0.05;

std::string Milliseconds(double value) {
  if (value < 9.95) return absl::StrFormat("%.1f", value);
  return absl::StrFormat("%.0f", value);
}

std::string MedianOf(const Row& row) {
  if (!row.failure.empty()) return "failed: " + row.failure;
  return Milliseconds(measure::Median(row.milliseconds));
}

std::string QuartilesOf(const Row& row) {
  if (!row.failure.empty()) return "";
  return absl::StrCat(Milliseconds(measure::Quantile(row.milliseconds, 0.25)), " to ",
                      Milliseconds(measure::Quantile(row.milliseconds, 0.75)));
}

std::string RatioOf(const Row& row, const Row& other) {
  if (!row.failure.empty() || !other.failure.empty()) return "";
  return Times(TimeRatio(row, other));
}

std::string ErrorOf(const Row& row) {
  if (!row.error) return "";
  const measure::FrameError& error = *row.error;
  if (error.rmse_low == error.rmse_high) return Percent(error.rmse);
  return absl::StrFormat("%s (%s to %s)", Percent(error.rmse), Number(error.rmse_low),
                         Number(error.rmse_high));
}

std::string SizeOf(const Row& row) { return absl::StrCat(row.width, " x ", row.height); }

std::string StagesOf(const Row& row) {
  return absl::StrJoin(row.stages, ", ", [](std::string* out, const StageTiming& stage) {
    absl::StrAppend(out, stage.stage, stage.on_device ? " (device) " : " ",
                    Milliseconds(stage.milliseconds));
  });
}

class Writer {
 public:
  Writer(const Results& results, const Making& making) : results_(results), making_(making) {}

  std::string Write() {
    text_ = "# What a frame costs\n\n";
    if (making_.short_form) {
      text_ +=
          "**Short form, to check the tool: frames too small and too few for figures that mean "
          "anything.**\n\n";
    }
    if (making_.others > kIdle) {
      absl::StrAppendFormat(&text_,
                            "**The machine was not idle: other programs took %.0f %% of it. Times "
                            "are too long, and ratios loose.**\n\n",
                            100.0 * making_.others);
    }
    WriteGoals();
    WriteFrame();
    WriteStages();
    WriteParticles();
    WriteSlices();
    WriteResolution();
    WriteTurntable();
    WriteService();
    WriteDevice();
    WriteMaking();
    return std::move(text_);
  }

 private:
  void Add(const std::vector<std::string>& cells) { absl::StrAppend(&text_, measure::Row(cells)); }
  void Head(const std::vector<std::string>& cells) {
    Add(cells);
    absl::StrAppend(&text_, Rule(cells.size()));
  }

  void WriteGoals() {
    absl::StrAppend(&text_,
                    "Milliseconds depend on the machine named below; ratios are medians of those "
                    "within a turn.\n\n## Goals\n\n");
    Head({"goal", "wanted", "reached", "by", ""});
    for (const Goal& goal : results_.goals) {
      Add({goal.what, absl::StrCat(goal.at_least ? "at least " : "at most ", goal.limit),
           absl::StrFormat("%.2f", goal.reached), goal.how, goal.met() ? "met" : "**not met**"});
    }
    absl::StrAppend(&text_,
                    "\nAs fast as the goals ask counts only at an error no worse than that of the "
                    "slicing it is held to; the yardstick's is in the next table.\n\n");
  }

  void WriteFrame() {
    const Row& any = results_.frame.front();
    absl::StrAppendFormat(
        &text_,
        "## One frame\n\nPlume frame 40 in %d particles, light from the side, %s pixels, drawn in "
        "turns, each time with particles that the renderer never saw before. Error: relative RMSE "
        "against the [image model](image-model.md). The yardstick is a compositor written by hand "
        "for AVX2 that can draw nothing but this scene, with one shadow value a particle.\n\n",
        any.particles, SizeOf(any));
    Head({"", "ms", "quartiles", absl::StrCat("of ", any.name), "error"});
    for (const Row& row : results_.frame) {
      Add({row.name, MedianOf(row), QuartilesOf(row), RatioOf(row, any), ErrorOf(row)});
    }
    text_ += "\n";
  }

  void WriteStages() {
    text_ += "## Where the time goes\n\nMedians by stage, ms.\n\n";
    Head({"", "stages"});
    for (const Row& row : results_.frame) Add({row.name, StagesOf(row)});
    text_ += "\n";
  }

  // Groups of the same contestants, each on a scene of its own, named by `label`.
  template <typename Label>
  void WriteGroups(const std::string& head, const std::vector<Group>& groups, const Label& label) {
    std::vector<std::string> cells = {head};
    for (const Row& row : groups.front()) {
      cells.push_back(row.name + ", ms");
      cells.push_back("error");
    }
    Head(cells);
    for (const Group& group : groups) {
      cells = {label(group.front())};
      for (const Row& row : group) {
        cells.push_back(MedianOf(row));
        cells.push_back(ErrorOf(row));
      }
      Add(cells);
    }
    text_ += "\n";
  }

  void WriteParticles() {
    absl::StrAppend(
        &text_, "## Against the number of particles\n\n",
        "The plume thinned out, or each particle several times, moved by up to half its radius; "
        "opacities keep the sum of optical depths. Errors are estimated from 1024 pixels, with the "
        "95 % interval; of more particles than have one, the reference takes too long.\n\n");
    WriteGroups("particles", results_.particles,
                [](const Row& row) { return absl::StrCat(row.particles); });
  }

  void WriteSlices() {
    text_ += "## Against slices\n\n";
    Head({"slices asked for", "", "ms", "quartiles", "error"});
    for (const Row& row : results_.slices) {
      Add({absl::StrCat(row.slices), row.role == Role::kClassic ? "classic" : row.name,
           MedianOf(row), QuartilesOf(row), ErrorOf(row)});
    }
    text_ += "\n";
  }

  void WriteResolution() {
    text_ += "## Against resolution\n\n";
    WriteGroups("pixels", results_.resolution, SizeOf);
  }

  void WriteTurntable() {
    absl::StrAppend(&text_, "## Turntable\n\n",
                    "The camera alone moves, by 3 degrees a frame, round the same particles: what "
                    "the first frame of them costs, and those that follow it.\n\n");
    Head({"", "ms", "quartiles"});
    for (const Row& row : results_.turntable) Add({row.name, MedianOf(row), QuartilesOf(row)});
    text_ += "\n";
  }

  void WriteService() {
    text_ += "## Service\n\n";
    if (results_.service.empty()) {
      text_ += "Not measured: this run was without the service.\n\n";
      return;
    }
    const Row& any = results_.service.front();
    absl::StrAppendFormat(&text_,
                          "%s pixels, from a halflightd of its own over a unix socket. Frames "
                          "of a sequence have particles of their own; their time is the whole "
                          "sequence's in parts.\n\n",
                          SizeOf(any));
    Head({"", "ms a frame", "quartiles"});
    for (const Row& row : results_.service) Add({row.name, MedianOf(row), QuartilesOf(row)});
    text_ += "\n";
  }

  void WriteDevice() {
    if (results_.device.empty()) return;
    absl::StrAppend(&text_, "## Frames a second on this device\n\n",
                    "By GL timestamps: what the stages on the device add up to. Whole: from "
                    "request to pixels in memory.\n\n");
    Head({"particles", "pixels", "", "device, frames/s", "whole, frames/s", "stages, ms"});
    for (const Group& group : results_.device) {
      for (const Row& row : group) {
        if (!row.failure.empty()) {
          Add({absl::StrCat(row.particles), SizeOf(row), row.name, MedianOf(row), "", ""});
          continue;
        }
        const std::optional<double> device = row.device_frames_per_second();
        Add({absl::StrCat(row.particles), SizeOf(row), row.name,
             device ? absl::StrFormat("%.1f", *device) : "none timed there",
             absl::StrFormat("%.1f", 1000.0 / measure::Median(row.milliseconds)), StagesOf(row)});
      }
    }
    text_ += "\n";
  }

  void WriteMaking() {
    absl::StrAppend(&text_, "## How this page was made\n\n");
    const auto add = [&](const std::string& what, const std::string& value) {
      absl::StrAppend(&text_, "- ", what, ": ", value, "\n");
    };
    add("Command", absl::StrCat("`", making_.command, "`, ", making_.date));
    add("Version", making_.version);
    add("Machine", absl::StrFormat("%s, %d cores, of which other programs took %.0f %%",
                                   making_.cpu, making_.cores, 100.0 * making_.others));
    add("GL renderer", absl::StrCat(making_.gl_renderer, "; OpenGL ", making_.gl_version));
    add("Time", absl::StrFormat("from request to pixels in memory, without encoding; medians of "
                                "%d turns after one to warm up, fewer for large frames",
                                results_.frame.front().milliseconds.size()));
    add("To compare something else", "a row in `tests/bench/contestants.cpp`");
  }

  const Results& results_;
  const Making& making_;
  std::string text_;
};

}  // namespace

std::string WritePage(const Results& results, const Making& making) {
  return Writer(results, making).Write();
}

}  // namespace halflight::bench
