#include "client/cli/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "absl/strings/ascii.h"
#include "client/cli/flag_values.h"
#include "client/cli/json.h"
#include "halflight/sha256.h"

namespace halflight::client {

namespace {

double StageMilliseconds(const v1::FrameHeader& header, std::string_view stage) {
  for (const v1::StageTiming& timing : header.timings()) {
    if (timing.stage() == stage) {
      return timing.milliseconds();
    }
  }
  return 0.0;
}

std::string OutputsJson(const FrameReport& report, const RenderedFrame& frame) {
  std::string list;
  for (size_t i = 0; i < report.paths.size(); ++i) {
    const v1::OutputInfo& info = frame.header.outputs(static_cast<int>(i));
    JsonObject output;
    output.Add("name", OutputName(info.output().kind()));
    output.Add("path", report.paths[i]);
    output.Add("sha256", ToHex(Sha256Of(frame.outputs[i])));
    output.AddJson("info", JsonOf(info));
    list += (i == 0 ? "" : ",") + output.Text();
  }
  return "[" + list + "]";
}

// "3.21 %".
std::string Percent(double fraction) { return fmt::format("{:.3g} %", 100.0 * fraction); }

// A line on how far the frame is from the image model, and one on where; a third where another
// frame stood in for it.
std::string ErrorText(const v1::MeasuredError& error) {
  if (error.covered_pixels() == 0) {
    return "error: none to measure, since no pixel is covered\n";
  }
  const bool all = error.sampled_pixels() == error.covered_pixels();
  const v1::EstimatedFigure& relative = error.relative_rmse();
  const v1::EstimatedFigure& bias = error.bias();
  std::string text = fmt::format("error: relative RMSE {}", Percent(relative.value()));
  if (!all) {
    text += fmt::format(" ({} to {} with 95 % confidence)", Percent(relative.low()),
                        Percent(relative.high()));
  }
  text += fmt::format(", bias {:+.3g}", bias.value());
  if (!all) {
    text += fmt::format(" ({:+.3g} to {:+.3g})", bias.low(), bias.high());
  }
  text += all ? fmt::format(", at all {} covered pixels\n", error.covered_pixels())
              : fmt::format(", from {} of {} covered pixels\n", error.sampled_pixels(),
                            error.covered_pixels());
  if (error.sample_worst_size() > 0) {
    const v1::PixelError& worst = error.sample_worst(0);
    text += fmt::format(
        "error: worst of them at x {}, y {}, where R G B are off by {:+.3g} {:+.3g} {:+.3g}; the "
        "image model's mean is {:.3g}\n",
        worst.x(), worst.y(), worst.r(), worst.g(), worst.b(), error.reference_mean());
  }
  if (error.compared() == v1::COMPARED_FRAME_WITHOUT_SCATTERING) {
    text += "error: of the frame without scattering, which the image model has not\n";
  }
  return text;
}

// "half-angle, 256 slices, light buffer 512".
std::string SettingsText(const v1::TargetAttempt& attempt) {
  constexpr std::string_view kPrefix = "SHADOW_TECHNIQUE_";
  const v1::Shadow& shadow = attempt.shadow();
  std::string text = v1::ShadowTechnique_Name(shadow.technique());
  if (text.rfind(kPrefix, 0) == 0) {
    text.erase(0, kPrefix.size());
  }
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return c == '_' ? '-' : absl::ascii_tolower(c); });
  if (shadow.technique() == v1::SHADOW_TECHNIQUE_HALF_ANGLE) {
    text +=
        fmt::format(", {} slices, light buffer {}", shadow.slices(), shadow.light_buffer_size());
  }
  if (shadow.technique() == v1::SHADOW_TECHNIQUE_LIGHT_SWEEP) {
    text += fmt::format(", degree {}, light buffer {}", shadow.fit_degree(),
                        shadow.light_buffer_size());
  }
  if (attempt.sampling().downsample() > 1) {
    text += fmt::format(", downsample {}", attempt.sampling().downsample());
  }
  return text;
}

// What the frame came to, of what was asked for.
std::string ReachedText(const v1::Target& target, const v1::TargetAttempt& attempt) {
  std::string text;
  if (attempt.has_relative_rmse()) {
    const v1::EstimatedFigure& error = attempt.relative_rmse();
    text = "error " + Percent(error.value());
    if (error.low() != error.high()) {
      text += fmt::format(" ({} to {})", Percent(error.low()), Percent(error.high()));
    }
    text += target.has_max_error() ? fmt::format(" of {} asked", Percent(target.max_error())) : "";
  }
  if (target.has_max_time_ms()) {
    text += fmt::format("{}{:.3g} ms of {:.3g} ms asked", text.empty() ? "" : ", ",
                        attempt.milliseconds(), target.max_time_ms());
  }
  return text;
}

const v1::TargetAttempt& Returned(const v1::TargetOutcome& outcome) {
  for (const v1::TargetAttempt& attempt : outcome.attempts()) {
    if (attempt.returned()) {
      return attempt;
    }
  }
  return v1::TargetAttempt::default_instance();
}

std::string TargetText(const v1::FrameHeader& header) {
  const v1::TargetOutcome& outcome = header.target();
  const v1::TargetAttempt& returned = Returned(outcome);
  return fmt::format("target: {}: {}: {}; {} frame{} tried in {:.0f} ms\n",
                     outcome.met() ? "met" : "NOT MET", ReachedText(outcome.target(), returned),
                     SettingsText(returned), outcome.attempts_size(),
                     outcome.attempts_size() == 1 ? "" : "s", StageMilliseconds(header, "search"));
}

}  // namespace

std::string TargetMissText(const v1::TargetOutcome& outcome) {
  return fmt::format("{}: {}", ReachedText(outcome.target(), Returned(outcome)), outcome.reason());
}

std::string ChoicesText(const std::vector<Choice>& choices) {
  std::string text;
  for (const Choice& choice : choices) {
    text += fmt::format("{}: {}\n", choice.name, choice.value);
  }
  return text;
}

std::string FrameText(const FrameReport& report, const RenderedFrame& frame) {
  std::string text;
  for (size_t i = 0; i < report.paths.size(); ++i) {
    const v1::OutputInfo& info = frame.header.outputs(static_cast<int>(i));
    text += fmt::format("{}: {}, {} x {}", report.paths[i], OutputName(info.output().kind()),
                        info.width(), info.height());
    text += info.layers() > 1 ? fmt::format(" x {} layers", info.layers()) : "";
    text += info.has_white_value() && info.has_black_value()
                ? fmt::format(", white is {:.6g}, black is {:.6g}", info.white_value(),
                              info.black_value())
                : "";
    text += fmt::format(", {} bytes\n", frame.outputs[i].size());
  }
  const v1::FrameMetadata& metadata = frame.header.metadata();
  text += fmt::format("{}{} particle{} in {:.0f} ms (server {:.0f} ms) on {}\n",
                      report.frame ? fmt::format("frame {}: ", *report.frame) : "",
                      metadata.particle_count(), metadata.particle_count() == 1 ? "" : "s",
                      report.milliseconds, StageMilliseconds(frame.header, "total"),
                      metadata.gl_renderer());
  if (frame.header.has_target()) {
    text += TargetText(frame.header);
  }
  if (frame.header.has_error()) {
    text += ErrorText(frame.header.error());
  }
  if (metadata.clamped_opacities() > 0) {
    text += fmt::format("{} opacities above 1 - 2^-20 were drawn as that\n",
                        metadata.clamped_opacities());
  }
  return text;
}

std::string FrameJson(const FrameReport& report, const RenderedFrame& frame,
                      const v1::RenderFrameRequest& request, const std::vector<Choice>& choices) {
  std::string chosen;
  for (const Choice& choice : choices) {
    JsonObject item;
    item.Add("name", choice.name);
    item.Add("value", choice.value);
    chosen += (chosen.empty() ? "" : ",") + item.Text();
  }
  std::string timings;
  for (const v1::StageTiming& timing : frame.header.timings()) {
    timings += (timings.empty() ? "" : ",") + JsonOf(timing);
  }
  JsonObject json;
  if (report.frame) {
    json.AddNumber("frame", *report.frame);
  }
  json.Add("input", report.input);
  json.AddNumber("milliseconds", report.milliseconds);
  json.AddNumber("server_milliseconds", StageMilliseconds(frame.header, "total"));
  json.Add("gl_renderer", frame.header.metadata().gl_renderer());
  json.AddNumber("particle_count", frame.header.metadata().particle_count());
  json.AddNumber("clamped_opacities", frame.header.metadata().clamped_opacities());
  json.AddJson("outputs", OutputsJson(report, frame));
  json.AddJson("choices", "[" + chosen + "]");
  json.AddJson("request", JsonOf(request));
  json.AddJson("metadata", JsonOf(frame.header.metadata()));
  json.AddJson("plan", JsonOf(frame.header.plan()));
  json.AddJson("timings", "[" + timings + "]");
  if (frame.header.has_error()) {
    json.AddJson("error", JsonOf(frame.header.error()));
  }
  if (frame.header.has_target()) {
    json.AddJson("target", JsonOf(frame.header.target()));
  }
  return json.Text();
}

}  // namespace halflight::client
