#include "tests/bench/figures.h"

#include <vector>

#include "absl/strings/str_join.h"
#include "client/cli/json_object.h"

namespace halflight::bench {
namespace {

using client::JsonNumber;
using client::JsonObject;

template <typename Items, typename Write>
std::string Array(const Items& items, const Write& write) {
  const auto append = [&](std::string* out, const auto& item) { out->append(write(item)); };
  return "[" + absl::StrJoin(items, ",\n", append) + "]";
}

const char* NameOf(Role role) {
  switch (role) {
    case Role::kBaseline:
      return "baseline";
    case Role::kClassic:
      return "classic";
    case Role::kOurs:
      return "ours";
    case Role::kYardstick:
      return "yardstick";
  }
  return "";
}

std::string StageObject(const StageTiming& stage) {
  JsonObject object;
  object.Add("stage", stage.stage);
  object.AddNumber("milliseconds", stage.milliseconds);
  object.AddJson("on_device", stage.on_device ? "true" : "false");
  return object.Text();
}

std::string ErrorObject(const measure::FrameError& error) {
  JsonObject object;
  object.AddNumber("rmse", error.rmse);
  object.AddNumber("rmse_low", error.rmse_low);
  object.AddNumber("rmse_high", error.rmse_high);
  object.AddNumber("bias", error.bias);
  object.AddNumber("p999", error.p999);
  object.AddNumber("max", error.max);
  return object.Text();
}

std::string RowObject(const Row& row) {
  JsonObject object;
  object.Add("name", row.name);
  object.Add("role", NameOf(row.role));
  object.AddNumber("particles", row.particles);
  object.AddNumber("width", row.width);
  object.AddNumber("height", row.height);
  object.AddNumber("slices", row.slices);
  object.AddJson("milliseconds",
                 Array(row.milliseconds, [](double value) { return JsonNumber(value); }));
  object.AddJson("stages", Array(row.stages, StageObject));
  if (!row.failure.empty()) object.Add("failure", row.failure);
  if (row.error) object.AddJson("relative_error", ErrorObject(*row.error));
  return object.Text();
}

std::string GroupArray(const Group& group) { return Array(group, RowObject); }

std::string GoalObject(const Goal& goal) {
  JsonObject object;
  object.Add("what", goal.what);
  object.AddNumber("reached", goal.reached);
  object.Add("bound", goal.at_least ? "at least" : "at most");
  object.AddNumber("limit", goal.limit);
  object.AddJson("met", goal.met() ? "true" : "false");
  object.Add("how", goal.how);
  return object.Text();
}

std::string MakingObject(const Making& making) {
  JsonObject object;
  object.Add("cpu", making.cpu);
  object.AddNumber("cores", making.cores);
  object.AddNumber("others", making.others);
  object.Add("gl_renderer", making.gl_renderer);
  object.Add("gl_version", making.gl_version);
  object.Add("version", making.version);
  object.Add("date", making.date);
  object.Add("command", making.command);
  object.AddJson("short_form", making.short_form ? "true" : "false");
  return object.Text();
}

}  // namespace

std::string WriteFigures(const Results& results, const Making& making) {
  JsonObject object;
  object.AddJson("making", MakingObject(making));
  object.AddJson("goals", Array(results.goals, GoalObject));
  object.AddJson("frame", GroupArray(results.frame));
  object.AddJson("particles", Array(results.particles, GroupArray));
  object.AddJson("slices", GroupArray(results.slices));
  object.AddJson("resolution", Array(results.resolution, GroupArray));
  object.AddJson("turntable", GroupArray(results.turntable));
  object.AddJson("service", GroupArray(results.service));
  object.AddJson("device", Array(results.device, GroupArray));
  return object.Text() + "\n";
}

}  // namespace halflight::bench
