#include "server/log/log.h"

#include <memory>

#include <spdlog/spdlog.h>
#include <unistd.h>

#include "server/log/stderr_sink.h"

namespace halflight {
namespace {

// Set before there are other threads.
LogFormat format_in_use = LogFormat::kText;

spdlog::level::level_enum ToSpdlog(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarn:
      return spdlog::level::warn;
    case LogLevel::kError:
      break;
  }
  return spdlog::level::err;
}

std::string Line(const char* event, const LogFields& fields) {
  return format_in_use == LogFormat::kJson ? LogJson(event, fields) : LogText(event, fields);
}

}  // namespace

void StartLog(const std::string& level, LogFormat format) {
  format_in_use = format;
  const auto sink = std::make_shared<DroppingSink>(STDERR_FILENO, [](uint64_t lines) {
    return Line("log_dropped", {{"lines", lines}, {"message", "nobody read the log"}});
  });
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("halflightd", sink));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern(format == LogFormat::kJson
                          ? R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l",%v})"
                          : "%Y-%m-%dT%H:%M:%S.%e%z level=%l %v");
}

void Log(LogLevel level, const char* event, const LogFields& fields) {
  const spdlog::level::level_enum at = ToSpdlog(level);
  if (spdlog::should_log(at)) {
    spdlog::log(at, Line(event, fields));
  }
}

}  // namespace halflight
