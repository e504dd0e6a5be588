#include "server/metrics/prometheus_metrics.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "server/convert/enums.h"
#include "server/error_detail.h"
#include "server/frame_log.h"

namespace halflight {
namespace {

// Seconds: from a stage that is hardly there to a frame at --max-frame-seconds.
constexpr std::array kStageSeconds = {0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1,  0.25,
                                      0.5,    1.0,   2.5,    5.0,   10.0, 30.0,  60.0, 300.0};

constexpr std::array kUploadEnds = {"committed", "already_present", "broken_off", "refused"};
constexpr std::array kCancellations = {"none", "client", "deadline", "stall"};

const char* NameOf(UploadEnd end) { return kUploadEnds[static_cast<size_t>(end)]; }
const char* NameOf(Cancellation by) { return kCancellations[static_cast<size_t>(by)]; }

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string NameOf(ShadowTechniqueKind technique) {
  constexpr size_t kPrefix = std::char_traits<char>::length("SHADOW_TECHNIQUE_");
  return Lower(v1::ShadowTechnique_Name(ToProto(kTechniques, technique)).substr(kPrefix));
}

}  // namespace

PrometheusMetrics::PrometheusMetrics()
    : frames_(AddCounters("halflight_frames_total", "Frames that came to their end")),
      stage_seconds_(prometheus::BuildHistogram()
                         .Name("halflight_frame_stage_seconds")
                         .Help("What frames that were made took, by stage")
                         .Register(registry_)),
      calls_(AddCounters("halflight_calls_total", "Calls that ended")),
      errors_(AddCounters("halflight_errors_total", "Calls that ended with an error")),
      cancellations_(AddCounters("halflight_cancellations_total",
                                 "Calls that were ended before they were finished")),
      received_(AddCounters("halflight_received_bytes_total", "Bytes of messages received")),
      sent_(AddCounters("halflight_sent_bytes_total", "Bytes of messages sent")),
      uploads_begun_(AddCounters("halflight_uploads_begun_total", "Uploads whose header came")),
      uploads_ended_(AddCounters("halflight_uploads_ended_total", "What became of those uploads")),
      sets_asked_(AddCounters("halflight_particle_sets_asked_total",
                              "Particle sets of which clients asked whether they are held")) {
  // A counter that is there from the start shows its first step as one.
  for (size_t i = 0; i < kRpcs; ++i) {
    received_of_[i] = &received_.Add({{"rpc", kRpcNames[i]}});
    sent_of_[i] = &sent_.Add({{"rpc", kRpcNames[i]}});
    calls_.Add({{"rpc", kRpcNames[i]}, {"code", "OK"}});
  }
  for (const Cancellation by :
       {Cancellation::kClient, Cancellation::kDeadline, Cancellation::kStall}) {
    cancellations_.Add({{"by", NameOf(by)}});
  }
  for (const char* end : kUploadEnds) {
    uploads_ended_.Add({{"end", end}});
  }
  for (const char* resumed : {"true", "false"}) {
    uploads_begun_.Add({{"resumed", resumed}});
  }
  for (const char* answer : {"present", "missing"}) {
    sets_asked_.Add({{"answer", answer}});
  }
}

PrometheusMetrics::Counters& PrometheusMetrics::AddCounters(const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry_);
}

void PrometheusMetrics::OnFrame(const std::string& tenant, ShadowTechniqueKind technique,
                                absl::StatusCode outcome, const std::vector<StageTiming>& timings) {
  CountFrame(tenant, NameOf(technique), outcome);
  if (outcome == absl::StatusCode::kOk) {
    for (const StageTiming& timing : timings) {
      Observe(StageKey(timing.stage), timing.milliseconds / 1000.0);
    }
  }
}

void PrometheusMetrics::OnFrameRefused(const std::string& tenant, absl::StatusCode outcome) {
  CountFrame(tenant, "none", outcome);
}

void PrometheusMetrics::CountFrame(const std::string& tenant, const std::string& technique,
                                   absl::StatusCode outcome) {
  frames_
      .Add({{"technique", technique},
            {"outcome", absl::StatusCodeToString(outcome)},
            {"tenant", TenantLabel(tenant)}})
      .Increment();
}

std::string PrometheusMetrics::TenantLabel(const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  if (tenants_.count(tenant) == 0) {
    if (tenants_.size() == kMaxTenants) {
      return "other";
    }
    tenants_.insert(tenant);
  }
  return tenant;
}

void PrometheusMetrics::OnFrameSent(std::chrono::steady_clock::duration took) {
  Observe("send", std::chrono::duration<double>(took).count());
}

void PrometheusMetrics::Observe(const std::string& stage, double seconds) {
  prometheus::Histogram* histogram = nullptr;
  {
    const std::lock_guard lock(mutex_);
    prometheus::Histogram*& of_stage = stages_[stage];
    if (of_stage == nullptr) {
      of_stage = &stage_seconds_.Add(
          {{"stage", stage}},
          prometheus::Histogram::BucketBoundaries(kStageSeconds.begin(), kStageSeconds.end()));
    }
    histogram = of_stage;
  }
  histogram->Observe(seconds);
}

void PrometheusMetrics::OnCall(Rpc rpc, const absl::Status& outcome, Cancellation by) {
  const std::string code = absl::StatusCodeToString(outcome.code());
  calls_.Add({{"rpc", halflight::NameOf(rpc)}, {"code", code}}).Increment();
  if (!outcome.ok()) {
    errors_.Add({{"code", code}, {"reason", ReasonName(DetailOf(outcome).reason)}}).Increment();
  }
  if (by != Cancellation::kNone) {
    cancellations_.Add({{"by", NameOf(by)}}).Increment();
  }
}

void PrometheusMetrics::OnReceived(Rpc rpc, size_t bytes) {
  received_of_[static_cast<size_t>(rpc)]->Increment(static_cast<double>(bytes));
}

void PrometheusMetrics::OnSent(Rpc rpc, size_t bytes) {
  sent_of_[static_cast<size_t>(rpc)]->Increment(static_cast<double>(bytes));
}

void PrometheusMetrics::OnUploadBegun(bool resumed) {
  uploads_begun_.Add({{"resumed", resumed ? "true" : "false"}}).Increment();
}

void PrometheusMetrics::OnUploadEnd(UploadEnd end) {
  uploads_ended_.Add({{"end", NameOf(end)}}).Increment();
}

void PrometheusMetrics::OnSetsAsked(size_t present, size_t missing) {
  sets_asked_.Add({{"answer", "present"}}).Increment(static_cast<double>(present));
  sets_asked_.Add({{"answer", "missing"}}).Increment(static_cast<double>(missing));
}

}  // namespace halflight
