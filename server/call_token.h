// One call under way: whose it is, whether it is served, and what the log and the metrics learn of
// it when it ends. Knows nothing of what the call does.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include "absl/status/status.h"
#include "server/access/access.h"
#include "server/caller.h"
#include "server/client_counts.h"
#include "server/handlers/backend.h"
#include "server/log/log_budget.h"
#include "server/metrics/metrics.h"

namespace halflight {

// How many calls are under way, and whether more may come.
struct CallCount {
  std::atomic<int> served = 0;  // all but those that were refused
  std::array<std::atomic<int>, kRpcs> active_of{};
  std::atomic<int> stalled = 0;  // those that should have ended for it
  std::atomic<uint64_t> begun = 0;
  LogBudget strangers_told{20};  // lines of calls that were refused
  LogBudget refusals_told{20};
  std::atomic<bool> draining = false;

  // One more of a client's calls; or nothing changes, and the error says whose calls are too many.
  absl::Status Enter(const std::string& client, const ServerLimits& limits);
  void Leave(const std::string& client);

 private:
  std::mutex mutex_;
  ClientCounts entered_;  // those that are served: who is refused takes nobody's place
};

// Counted as served before draining is looked at, so that whoever drains and then sees none can be
// sure that none slips in, and that the log has a line of each. Those that are refused hold nobody
// up.
class CallToken {
 public:
  // At the beginning of a call, whose name the client learns by its initial metadata: the one that
  // it sent as x-request-id, else `request_id` of the request's message, else a new one. One that
  // is none (request_id.h) counts as not sent. All but the name outlives the token.
  CallToken(Rpc rpc, CallCount& count, const Backend& backend, const Access& access,
            grpc::CallbackServerContext& context, const std::string& request_id = "");
  // At its end.
  ~CallToken();
  CallToken(const CallToken&) = delete;
  CallToken& operator=(const CallToken&) = delete;
  CallToken(CallToken&&) = delete;
  CallToken& operator=(CallToken&&) = delete;

  // Why the call is not served, or OK.
  [[nodiscard]] const absl::Status& refusal() const { return refusal_; }
  // Of no tenant where it is refused.
  [[nodiscard]] const Caller& caller() const { return caller_; }

  // A message of so many bytes. Each by one thread at a time.
  void OnReceived(size_t bytes);
  void OnSent(size_t bytes);

  // Ends the call because its peer has kept it waiting for so long. Any thread; the token may be
  // gone when it returns.
  void EndForStall(std::chrono::seconds waited);

  // What to finish the call with, right before that.
  grpc::Status End(const absl::Status& status);

 private:
  absl::Status Enter(const Access& access, const ServerLimits& limits);
  [[nodiscard]] Cancellation EndedBy() const;
  void WriteLog(const absl::Status& outcome, Cancellation by) const;

  const Rpc rpc_;
  CallCount& count_;
  Metrics& metrics_;
  grpc::CallbackServerContext& context_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  Caller caller_;
  bool entered_ = false;
  absl::Status refusal_;
  std::atomic<uint64_t> received_ = 0;
  std::atomic<uint64_t> sent_ = 0;
  std::atomic<bool> stalled_ = false;
  absl::Status outcome_ = absl::CancelledError("ended by nobody");
};

}  // namespace halflight
