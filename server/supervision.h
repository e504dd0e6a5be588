// What the main thread does while the service runs: waits for what ends it, meanwhile looks after
// device and memory, and drains.
#pragma once

#include <chrono>
#include <csignal>
#include <optional>
#include <string>

#include "renderer/frame_engine.h"
#include "server/grpc_server.h"
#include "server/handlers/backend.h"

namespace halflight {

// What is wrong with the device so that nothing but a new process helps; none where it is well: it
// has not come back for longer than `patience`, where that is not 0, or cannot be had again.
std::optional<std::string> DeviceTrouble(const EngineState& state, std::chrono::seconds patience,
                                         std::chrono::steady_clock::time_point now);

class Supervision {
 public:
  // All outlive it; `signals` are blocked. `patience` as above.
  Supervision(GrpcServer& server, const FrameEngine& engine, const Backend& backend,
              const sigset_t& signals, std::chrono::seconds patience);

  // The signal that ends the service; none where the device does, and that is logged. Meanwhile
  // tells the service manager that it is well, and gives memory back: of uploads that nobody
  // resumes, and of frames whenever they have stopped coming, or every few minutes.
  std::optional<int> WaitForEnd();

  // Turns newcomers away and waits for what is under way: calls, frames whose calls have gone, what
  // waits to be written to disk. False when a second signal or the time came first.
  bool Drain(std::chrono::milliseconds most);

 private:
  void GiveMemoryBack();

  GrpcServer& server_;
  const FrameEngine& engine_;
  const Backend& backend_;
  const sigset_t signals_;
  const std::chrono::seconds patience_;
  uint64_t frames_seen_ = 0;
  std::optional<uint64_t> given_back_;  // after so much work
  std::chrono::steady_clock::time_point last_given_back_ = std::chrono::steady_clock::now();
};

}  // namespace halflight
