#include "tests/report/measure.h"

#include <utility>

#include "tests/measure/timing.h"
#include "tests/report/pareto.h"

namespace halflight::report {
namespace {

// One scene with one setting, both by index.
struct Job {
  size_t scene;
  size_t setting;
};

// Fills in all but the errors and the front. The baseline is among the jobs.
absl::StatusOr<std::vector<Image>> TimeJobs(FrameRenderer& renderer, const std::vector<Job>& jobs,
                                            size_t baseline, int repeats, Results& results) {
  std::vector<measure::Entrant> entrants;
  for (const Job& job : jobs) {
    entrants.push_back({measure::DrawWith(renderer),
                        Apply(results.settings[job.setting], results.scenes[job.scene].scene)});
  }
  std::vector<measure::TimedFrame> frames = measure::TimeInTurns(entrants, repeats);
  std::vector<Image> images;
  for (size_t i = 0; i < jobs.size(); ++i) {
    measure::TimedFrame& frame = frames[i];
    if (!frame.status.ok()) return frame.status;
    results.measurements.push_back(
        {.scene = jobs[i].scene,
         .setting = jobs[i].setting,
         .repeats = repeats,
         .milliseconds = measure::Median(frame.milliseconds),
         .time_ratio = measure::MedianRatio(frame.milliseconds, frames[baseline].milliseconds),
         .error = {},
         .on_front = false});
    images.push_back(std::move(frame.beauty));
  }
  return images;
}

absl::Status MeasureMatrixScene(FrameRenderer& renderer, size_t scene, int repeats,
                                Results& results) {
  std::vector<Job> jobs;
  size_t baseline = 0;
  for (size_t setting = 0; setting < results.settings.size(); ++setting) {
    if (results.settings[setting].baseline) baseline = jobs.size();
    jobs.push_back({scene, setting});
  }
  const size_t first = results.measurements.size();
  const absl::StatusOr<std::vector<Image>> images =
      TimeJobs(renderer, jobs, baseline, repeats, results);
  if (!images.ok()) return images.status();
  const measure::CoveredReference reference = measure::EvaluateCovered(results.scenes[scene].scene);
  for (size_t i = 0; i < jobs.size(); ++i) {
    results.measurements[first + i].error = measure::CompareAll((*images)[i], reference);
  }
  return absl::OkStatus();
}

absl::Status MeasureScaling(FrameRenderer& renderer, int repeats, Results& results) {
  std::vector<Job> jobs;
  size_t baseline = 0;
  for (size_t scene = 0; scene < results.scenes.size(); ++scene) {
    const ReportScene& of = results.scenes[scene];
    if (of.part != Part::kScaling) continue;
    for (size_t setting = 0; setting < results.settings.size(); ++setting) {
      if (of.scene.particles->size() > results.settings[setting].scaling_most) continue;
      if (of.scaling_baseline && results.settings[setting].baseline) baseline = jobs.size();
      jobs.push_back({scene, setting});
    }
  }
  const size_t first = results.measurements.size();
  const absl::StatusOr<std::vector<Image>> images =
      TimeJobs(renderer, jobs, baseline, repeats, results);
  if (!images.ok()) return images.status();
  std::unique_ptr<const reference::Evaluator> evaluator;
  for (size_t i = 0; i < jobs.size(); ++i) {
    if (i == 0 || jobs[i].scene != jobs[i - 1].scene) {
      auto made = reference::Evaluator::Create(results.scenes[jobs[i].scene].scene);
      if (!made.ok()) return made.status();
      evaluator = *std::move(made);
    }
    const absl::StatusOr<measure::FrameError> error =
        measure::CompareSample((*images)[i], *evaluator);
    if (!error.ok()) return error.status();
    results.measurements[first + i].error = *error;
  }
  return absl::OkStatus();
}

void MarkFronts(Results& results) {
  for (size_t scene = 0; scene < results.scenes.size(); ++scene) {
    std::vector<CostAndError> points;
    std::vector<Measurement*> of_scene;
    for (Measurement& measurement : results.measurements) {
      if (measurement.scene != scene) continue;
      points.push_back({measurement.time_ratio, measurement.error.rmse});
      of_scene.push_back(&measurement);
    }
    const std::vector<bool> front = ParetoFront(points);
    for (size_t i = 0; i < front.size(); ++i) of_scene[i]->on_front = front[i];
  }
}

}  // namespace

absl::StatusOr<Results> MeasureAll(FrameRenderer& renderer, std::vector<ReportScene> scenes,
                                   std::vector<Setting> settings, const MeasureOptions& options) {
  Results results{std::move(scenes), std::move(settings), {}};
  for (size_t scene = 0; scene < results.scenes.size(); ++scene) {
    if (results.scenes[scene].part != Part::kMatrix) continue;
    options.progress(results.scenes[scene].name);
    const absl::Status status = MeasureMatrixScene(renderer, scene, options.repeats, results);
    if (!status.ok()) return status;
  }
  options.progress("cost against particles");
  const absl::Status status = MeasureScaling(renderer, options.scaling_repeats, results);
  if (!status.ok()) return status;
  MarkFronts(results);
  return results;
}

}  // namespace halflight::report
