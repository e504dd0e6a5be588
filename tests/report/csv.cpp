#include "tests/report/csv.h"

#include "absl/strings/str_format.h"

namespace halflight::report {

std::string WriteCsv(const Results& results) {
  std::string text =
      "scene,plume,light,opacity,particles,setting,flags,repeats,milliseconds,time_ratio,rmse,"
      "rmse_low,rmse_high,bias,p999,max,on_front\n";
  for (const Measurement& m : results.measurements) {
    const ReportScene& scene = results.scenes[m.scene];
    const Setting& setting = results.settings[m.setting];
    absl::StrAppendFormat(
        &text, "%s,%s,%s,%s,%d,%s,%s,%d,%.2f,%.6f,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%d\n", scene.name,
        scene.plume, scene.light, scene.opacity, scene.scene.particles->size(), setting.name,
        setting.flags, m.repeats, m.milliseconds, m.time_ratio, m.error.rmse, m.error.rmse_low,
        m.error.rmse_high, m.error.bias, m.error.p999, m.error.max, m.on_front ? 1 : 0);
  }
  return text;
}

}  // namespace halflight::report
