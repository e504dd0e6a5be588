// What the parts of the server tell of what happens, to be counted. Knows no way of showing it.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "renderer/frame.h"

namespace halflight {

enum class Rpc : uint8_t {
  kGetServerInfo,
  kFindMissingParticles,
  kQueryUpload,
  kUploadParticles,
  kRenderFrame,
  kRenderSequence,
};
inline constexpr std::array kRpcNames = {"GetServerInfo", "FindMissingParticles",
                                         "QueryUpload",   "UploadParticles",
                                         "RenderFrame",   "RenderSequence"};
inline constexpr size_t kRpcs = kRpcNames.size();

inline const char* NameOf(Rpc rpc) { return kRpcNames[static_cast<size_t>(rpc)]; }

// Who ended a call before it was finished.
enum class Cancellation : uint8_t {
  kNone,
  kClient,    // it cancelled, or went away
  kDeadline,  // the client's
  kStall,     // the server, of a peer that neither reads nor sends
};

// What became of an upload whose header arrived.
enum class UploadEnd : uint8_t {
  kCommitted,
  kAlreadyPresent,
  kBrokenOff,  // without finish: what arrived may be kept to be resumed
  kRefused,
};

// Everything here does nothing: who is not to count gets None(). Any thread, and cheap.
class Metrics {
 public:
  virtual ~Metrics() = default;

  // A frame that had been accepted has come to its end.
  virtual void OnFrame(const std::string& /*tenant*/, ShadowTechniqueKind /*technique*/,
                       absl::StatusCode /*outcome*/, const std::vector<StageTiming>& /*timings*/) {}
  // One that was not accepted.
  virtual void OnFrameRefused(const std::string& /*tenant*/, absl::StatusCode /*outcome*/) {}
  // The last message of a frame is with gRPC; how long sending took.
  virtual void OnFrameSent(std::chrono::steady_clock::duration /*took*/) {}

  // A call has ended, as `outcome` says.
  virtual void OnCall(Rpc /*rpc*/, const absl::Status& /*outcome*/, Cancellation /*by*/) {}
  // Bytes of messages, received or sent.
  virtual void OnReceived(Rpc /*rpc*/, size_t /*bytes*/) {}
  virtual void OnSent(Rpc /*rpc*/, size_t /*bytes*/) {}

  // A header has arrived; resumed: it goes on with what broke off.
  virtual void OnUploadBegun(bool /*resumed*/) {}
  virtual void OnUploadEnd(UploadEnd /*end*/) {}
  // A client has asked of so many sets whether they are held.
  virtual void OnSetsAsked(size_t /*present*/, size_t /*missing*/) {}

  static Metrics& None() {
    static Metrics none;
    return none;
  }
};

}  // namespace halflight
