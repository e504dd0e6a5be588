// How long the stages of a frame take, on the CPU and on the device. Render thread only.
#pragma once

#include <epoxy/gl.h>

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "renderer/frame.h"
#include "renderer/gl/object.h"

namespace halflight {

// Stages follow one another: each lasts from its Begin to the next. CPU stages are timed by the
// steady clock, device stages by GL timestamps, which are read only at the end so that nothing
// waits. A timestamp is taken when the device has done what came before it, so that a stage has
// nothing of a frame that was recorded earlier. Stages of the same name are summed.
class StageClock {
 public:
  void BeginCpu(const char* stage);
  void BeginGpu(const char* stage);

  // Ends the stage: what goes on until the next one is not the frame's.
  void EndStage();

  // Ends the last stage and waits for the device.
  std::vector<StageTiming> Finish();

 private:
  using Clock = std::chrono::steady_clock;
  struct GpuSpan {
    std::string stage;
    gl::Query begin;
    gl::Query end;
  };

  void Add(const std::string& stage, double milliseconds, bool on_device);

  std::vector<StageTiming> timings_;
  std::vector<GpuSpan> gpu_spans_;
  std::string cpu_stage_;
  Clock::time_point cpu_begin_;
  bool in_gpu_stage_ = false;
};

}  // namespace halflight
