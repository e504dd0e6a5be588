// The server's log: one line an event on stderr. What a line says stands in log_event.h.
#pragma once

#include <cstdint>
#include <string>

#include "server/log/log_event.h"

namespace halflight {

enum class LogLevel : uint8_t { kDebug, kInfo, kWarn, kError };

enum class LogFormat : uint8_t { kText, kJson };

// Once, before there are other threads. `level`: trace, debug, info, warn, error or off; lines of
// lower levels are not written. Before it is called lines are text and go to stdout.
void StartLog(const std::string& level, LogFormat format);

// Writes a line. Any thread.
void Log(LogLevel level, const char* event, const LogFields& fields = {});

}  // namespace halflight
