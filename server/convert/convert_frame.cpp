#include "server/convert/convert_frame.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "halflight/sha256.h"
#include "renderer/shadow_technique.h"
#include "server/convert/convert_scene.h"
#include "server/convert/convert_shadow.h"
#include "server/convert/field_checks.h"
#include "server/convert/scene_checks.h"
#include "server/error_detail.h"
#include "server/particle_upload.h"
#include "server/request_id.h"

namespace halflight {
namespace {

void CheckRequestId(const std::string& id, FieldChecks& checks) {
  const std::string allowed =
      fmt::format("at most {} bytes of printable ASCII", kMaxRequestIdBytes);
  if (id.size() > kMaxRequestIdBytes) {
    checks.Reject("request_id", fmt::format("{} bytes", id.size()), allowed);
  }
  const auto bad =
      std::find_if(id.begin(), id.end(), [](unsigned char c) { return c < 0x20 || c > 0x7e; });
  if (bad != id.end()) {
    checks.Reject(
        "request_id",
        fmt::format("byte {:#04x} at {}", static_cast<unsigned char>(*bad), bad - id.begin()),
        allowed);
  }
}

// What makes no difference to the frame is left out.
std::string FingerprintOf(const v1::RenderFrameRequest& request, const NamedParticles& particles) {
  v1::RenderFrameRequest made_from = request;
  made_from.clear_request_id();
  made_from.clear_priority();
  made_from.mutable_scene()->set_particle_sha256(particles.sha256);
  return Sha256Of(made_from.SerializeAsString());
}

uint64_t HeldBytes(const FrameJob& job, uint64_t output_bytes) {
  uint64_t bytes = output_bytes;
  const bool shown =
      std::any_of(job.outputs.begin(), job.outputs.end(),
                  [](const OutputJob& output) { return output.shown.kind == ImageKind::kBeauty; });
  if (job.measure.has_value() && (job.measure->without_scattering || !shown)) {
    bytes += PixelBytes({{.shown = {ImageKind::kBeauty}}}, job.request.scene);
  }
  return job.target.has_value() ? 2 * bytes : bytes;
}

}  // namespace

absl::StatusOr<NamedParticles> ResolveParticles(const v1::Scene& scene, ParticleStore& store,
                                                const ServerLimits& limits) {
  switch (scene.particles_case()) {
    case v1::Scene::kInlineParticles:
      return BuildInlineParticles(scene.inline_particles(), limits);
    case v1::Scene::kParticleSha256: {
      const std::string& sha256 = scene.particle_sha256();
      if (sha256.size() != kSha256Bytes) {
        return FieldError("scene.particle_sha256", fmt::format("{} bytes", sha256.size()),
                          fmt::format("{} bytes", kSha256Bytes));
      }
      auto set = store.Find(sha256);
      if (set == nullptr) {
        return WithReason(
            absl::NotFoundError(fmt::format("scene.particle_sha256: {} is not held by "
                                            "this server (any more): upload it first",
                                            ToHex(sha256))),
            v1::ERROR_REASON_PARTICLES_NOT_FOUND);
      }
      return NamedParticles{sha256, std::move(set)};
    }
    case v1::Scene::PARTICLES_NOT_SET:
      break;
  }
  return FieldError("scene.particles", "unset", "particle_sha256 or inline_particles");
}

absl::StatusOr<FrameJob> ConvertFrame(const v1::RenderFrameRequest& request,
                                      const NamedParticles& particles, const ServerLimits& limits,
                                      const DeviceInfo& device) {
  FieldChecks checks;
  CheckRequestId(request.request_id(), checks);
  FrameJob job;
  job.request_id = request.request_id();
  job.priority = checks.InRange("priority", request.priority(), {.low = -100.0, .high = 100.0});
  job.particle_sha256 = particles.sha256;
  if (request.has_target()) {
    CheckTarget(request, checks);
  }
  job.request.scene = ConvertScene(request.scene(), particles.set, limits, checks);
  if (checks.ok()) {
    Scene& scene = job.request.scene;
    OutputPlan plan = ConvertOutputs(request.outputs(), scene, limits, checks);
    job.request.images = plan.images;
    if (LeavesTechniqueOpen(request.scene().shadow())) {
      scene.shadow.technique = DefaultTechnique(job.request, device.software);
    }
    scene.shadow.compositor = CompositorFor(scene.shadow.compositor, device.software);
    if (checks.ok() && !request.has_target()) {
      CheckTechnique(scene, limits, checks);
    }
    if (checks.ok()) {
      job.measure = ConvertMeasurement(request, scene, limits, plan, checks);
    }
    if (checks.ok() && request.has_target()) {
      const bool sampled = job.measure.has_value() && job.measure->sample.has_value();
      job.target = ConvertTarget(request, scene,
                                 (sampled ? *job.measure->sample : ErrorEstimateOptions{}).samples,
                                 limits, plan);
    }
    job.request.images = std::move(plan.images);
    // What a search learns of costs shall hold for frames that nothing went before.
    job.request.reuse = !request.has_target();
    job.outputs = std::move(plan.outputs);
    job.pixel_bytes = HeldBytes(job, plan.pixel_bytes);
  }
  if (!checks.ok()) {
    return checks.status();
  }
  job.fingerprint = FingerprintOf(request, particles);
  return job;
}

absl::StatusOr<FrameJob> ConvertRequest(const v1::RenderFrameRequest& request, ParticleStore& store,
                                        const ServerLimits& limits, const DeviceInfo& device) {
  const auto particles = ResolveParticles(request.scene(), store, limits);
  if (!particles.ok()) {
    return particles.status();
  }
  return ConvertFrame(request, *particles, limits, device);
}

}  // namespace halflight
