// Where the log goes. Whoever reads it may stop: a log that waited for that would hold up every
// call, and the end of the server.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include <spdlog/sinks/base_sink.h>

namespace halflight {

// Writes lines to a descriptor, which it does not own, as long as there is room for them: then
// waits for some of it once, drops what follows, and says how many lines that were as soon as there
// is room again.
class DroppingSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  // `dropped`: the message of how many there were, as the lines have it.
  using Notice = std::string (*)(uint64_t lines);
  DroppingSink(int fd, Notice dropped) : fd_(fd), notice_(dropped) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}

 private:
  bool Write(const spdlog::details::log_msg& message);
  [[nodiscard]] bool HasRoom() const;

  const int fd_;
  const Notice notice_;
  uint64_t dropped_ = 0;  // since the last line
  bool torn_ = false;     // of which only a part was written
};

}  // namespace halflight
