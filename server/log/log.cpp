#include "server/log/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

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

}  // namespace

void StartLog(const std::string& level, LogFormat format) {
  format_in_use = format;
  spdlog::set_default_logger(spdlog::stderr_logger_mt("halflightd"));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern(format == LogFormat::kJson
                          ? R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l",%v})"
                          : "%Y-%m-%dT%H:%M:%S.%e%z level=%l %v");
  spdlog::flush_on(spdlog::level::info);
}

void Log(LogLevel level, const char* event, const LogFields& fields) {
  const spdlog::level::level_enum at = ToSpdlog(level);
  if (spdlog::should_log(at)) {
    spdlog::log(
        at, format_in_use == LogFormat::kJson ? LogJson(event, fields) : LogText(event, fields));
  }
}

}  // namespace halflight
