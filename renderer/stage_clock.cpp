#include "renderer/stage_clock.h"

namespace halflight {

namespace {

gl::Query Timestamp() {
  GLuint name = 0;
  glCreateQueries(GL_TIMESTAMP, 1, &name);
  glQueryCounter(name, GL_TIMESTAMP);
  return gl::Query(name);
}

double Nanoseconds(const gl::Query& query) {
  GLuint64 value = 0;
  glGetQueryObjectui64v(query.name(), GL_QUERY_RESULT, &value);
  return static_cast<double>(value);
}

}  // namespace

void StageClock::BeginCpu(const char* stage) {
  EndStage();
  cpu_stage_ = stage;
  cpu_begin_ = Clock::now();
}

void StageClock::BeginGpu(const char* stage) {
  EndStage();
  gpu_spans_.push_back({stage, Timestamp(), {}});
  in_gpu_stage_ = true;
}

void StageClock::EndStage() {
  if (in_gpu_stage_) {
    gpu_spans_.back().end = Timestamp();
    in_gpu_stage_ = false;
  }
  if (!cpu_stage_.empty()) {
    const std::chrono::duration<double, std::milli> elapsed = Clock::now() - cpu_begin_;
    Add(std::exchange(cpu_stage_, {}), elapsed.count(), false);
  }
}

void StageClock::Add(const std::string& stage, double milliseconds, bool on_device) {
  for (StageTiming& timing : timings_) {
    if (timing.stage == stage) {
      timing.milliseconds += milliseconds;
      return;
    }
  }
  timings_.push_back({stage, milliseconds, on_device});
}

std::vector<StageTiming> StageClock::Finish() {
  EndStage();
  for (const GpuSpan& span : gpu_spans_) {
    Add(span.stage, (Nanoseconds(span.end) - Nanoseconds(span.begin)) * 1e-6, true);
  }
  return std::move(timings_);
}

}  // namespace halflight
