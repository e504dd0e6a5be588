// Counts what happens, in Prometheus's terms. What is read off the parts when somebody looks stands
// in state_collector.h.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include "server/metrics/metrics.h"

namespace halflight {

class PrometheusMetrics final : public Metrics {
 public:
  // Tenants that are told apart, those that come first; all others together are "other". Tokens
  // are a list in a file, but certificates may name as many tenants as their authority likes.
  static constexpr size_t kMaxTenants = 100;

  PrometheusMetrics();

  void OnFrame(const std::string& tenant, ShadowTechniqueKind technique, absl::StatusCode outcome,
               const std::vector<StageTiming>& timings) override;
  void OnFrameRefused(const std::string& tenant, absl::StatusCode outcome) override;
  void OnFrameSent(std::chrono::steady_clock::duration took) override;
  void OnCall(Rpc rpc, const absl::Status& outcome, Cancellation by) override;
  void OnReceived(Rpc rpc, size_t bytes) override;
  void OnSent(Rpc rpc, size_t bytes) override;
  void OnUploadBegun(bool resumed) override;
  void OnUploadEnd(UploadEnd end) override;
  void OnSetsAsked(size_t present, size_t missing) override;

  [[nodiscard]] std::vector<prometheus::MetricFamily> Collect() const {
    return registry_.Collect();
  }

 private:
  using Counters = prometheus::Family<prometheus::Counter>;

  Counters& AddCounters(const char* name, const char* help);
  void CountFrame(const std::string& tenant, const std::string& technique,
                  absl::StatusCode outcome);
  std::string TenantLabel(const std::string& tenant);
  void Observe(const std::string& stage, double seconds);

  prometheus::Registry registry_;
  Counters& frames_;
  prometheus::Family<prometheus::Histogram>& stage_seconds_;
  Counters& calls_;
  Counters& errors_;
  Counters& cancellations_;
  Counters& received_;
  Counters& sent_;
  Counters& uploads_begun_;
  Counters& uploads_ended_;
  Counters& sets_asked_;
  // Of every message: not looked up each time.
  std::array<prometheus::Counter*, kRpcs> received_of_{};
  std::array<prometheus::Counter*, kRpcs> sent_of_{};

  std::mutex mutex_;
  std::set<std::string> tenants_;
  std::unordered_map<std::string, prometheus::Histogram*> stages_;
};

}  // namespace halflight
