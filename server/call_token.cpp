#include "server/call_token.h"

#include <utility>

#include <fmt/format.h>

#include "server/error_detail.h"
#include "server/log/log.h"
#include "server/request_id.h"
#include "server/status_text.h"
#include "server/status_to_grpc.h"

namespace halflight {
namespace {

std::string CallName(const grpc::CallbackServerContext& context, const std::string& request_id) {
  const auto sent = context.client_metadata().find(kRequestIdKey);
  if (sent != context.client_metadata().end()) {
    std::string name(sent->second.data(), sent->second.size());
    if (IsRequestId(name)) {
      return name;
    }
  }
  return IsRequestId(request_id) ? request_id : MakeRequestId();
}

// As the client sees it, whatever the server made of it meanwhile.
absl::Status OutcomeOf(const absl::Status& status, Cancellation by) {
  switch (by) {
    case Cancellation::kNone:
      return status;
    case Cancellation::kDeadline:
      return absl::DeadlineExceededError("the client's deadline has passed");
    case Cancellation::kClient:
      return absl::CancelledError("the client cancelled the call, or is gone");
    case Cancellation::kStall:
      break;
  }
  return absl::CancelledError("the client kept the call waiting for too long");
}

}  // namespace

absl::Status CallCount::Enter(const std::string& client, const ServerLimits& limits) {
  const std::lock_guard lock(mutex_);
  if (entered_.total() >= limits.max_calls) {
    return BusyError(v1::ERROR_REASON_TOO_MANY_CALLS,
                     fmt::format("{} calls are under way", entered_.total()),
                     fmt::format("at most {}", limits.max_calls));
  }
  if (entered_.Of(client) >= limits.max_client_calls) {
    return BusyError(v1::ERROR_REASON_TOO_MANY_CALLS,
                     fmt::format("{} calls of this client are under way", entered_.Of(client)),
                     fmt::format("at most {}", limits.max_client_calls));
  }
  entered_.Add(client);
  return absl::OkStatus();
}

void CallCount::Leave(const std::string& client) {
  const std::lock_guard lock(mutex_);
  entered_.Remove(client);
}

CallToken::CallToken(Rpc rpc, CallCount& count, const Backend& backend, const Access& access,
                     grpc::CallbackServerContext& context, const std::string& request_id)
    : rpc_(rpc),
      count_(count),
      metrics_(backend.metrics),
      context_(context),
      caller_{.peer = context.peer(), .call_id = CallName(context, request_id)} {
  context.AddInitialMetadata(kRequestIdKey, caller_.call_id);
  ++count_.begun;
  ++count_.active_of[static_cast<size_t>(rpc)];
  ++count_.served;
  refusal_ = Enter(access, backend.limits);
  entered_ = refusal_.ok();
  count_.served -= entered_ ? 0 : 1;
}

absl::Status CallToken::Enter(const Access& access, const ServerLimits& limits) {
  if (count_.draining) {
    return DrainingError();
  }
  auto tenant = access.TenantOf(context_);
  if (!tenant.ok()) {
    return WithReason(tenant.status(), v1::ERROR_REASON_UNAUTHENTICATED);
  }
  caller_.tenant = *std::move(tenant);
  return count_.Enter(caller_.client(), limits);
}

CallToken::~CallToken() {
  const Cancellation by = EndedBy();
  const absl::Status outcome = OutcomeOf(outcome_, by);
  metrics_.OnCall(rpc_, outcome, by);
  WriteLog(outcome, by);
  if (entered_) {
    count_.Leave(caller_.client());
    --count_.served;
  }
  count_.stalled -= stalled_ ? 1 : 0;
  --count_.active_of[static_cast<size_t>(rpc_)];
}

Cancellation CallToken::EndedBy() const {
  if (!context_.IsCancelled()) {
    return Cancellation::kNone;
  }
  if (stalled_) {
    return Cancellation::kStall;
  }
  return context_.deadline() <= std::chrono::system_clock::now() ? Cancellation::kDeadline
                                                                 : Cancellation::kClient;
}

void CallToken::WriteLog(const absl::Status& outcome, Cancellation by) const {
  LogFields fields = {{"rpc", NameOf(rpc_)}, {"request_id", caller_.call_id}};
  // Whoever is refused can call again at once, and for ever.
  LogBudget& budget =
      absl::IsUnauthenticated(outcome) ? count_.strangers_told : count_.refusals_told;
  const auto refused = entered_ ? std::nullopt : budget.Take();
  if (refused.has_value()) {
    fields.emplace_back("since_last_told", *refused);
  }
  if (!caller_.tenant.empty()) {
    fields.emplace_back("tenant", caller_.tenant);
  }
  fields.emplace_back("peer", caller_.peer);
  fields.emplace_back("received_bytes", received_.load());
  fields.emplace_back("sent_bytes", sent_.load());
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin_;
  fields.emplace_back("total_ms", took.count());
  fields.emplace_back("outcome", absl::StatusCodeToString(outcome.code()));
  if (const auto reason = DetailOf(outcome).reason; reason != v1::ERROR_REASON_UNSPECIFIED) {
    fields.emplace_back("reason", ReasonName(reason));
  }
  if (!outcome.ok()) {
    fields.emplace_back("message", MessageOf(outcome));
  }
  // Frames that went well have lines of their own, and questions are many.
  const bool told = entered_ ? !outcome.ok() || rpc_ == Rpc::kUploadParticles : refused.has_value();
  const bool our_fault = absl::IsInternal(outcome) && by == Cancellation::kNone;
  Log(our_fault ? LogLevel::kWarn : told ? LogLevel::kInfo : LogLevel::kDebug, "call", fields);
}

void CallToken::OnReceived(size_t bytes) {
  received_ += bytes;
  metrics_.OnReceived(rpc_, bytes);
}

void CallToken::OnSent(size_t bytes) {
  sent_ += bytes;
  metrics_.OnSent(rpc_, bytes);
}

void CallToken::EndForStall(std::chrono::seconds waited) {
  if (stalled_.exchange(true)) {
    return;  // in another of its steps
  }
  ++count_.stalled;
  Log(LogLevel::kWarn, "call_stalled",
      {{"rpc", NameOf(rpc_)},
       {"request_id", caller_.call_id},
       {"peer", caller_.peer},
       {"seconds", waited.count()}});
  context_.TryCancel();
}

grpc::Status CallToken::End(const absl::Status& status) {
  outcome_ = status;
  return ToGrpc(status, context_);
}

}  // namespace halflight
