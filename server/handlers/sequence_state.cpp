#include "server/handlers/sequence_state.h"

#include <utility>

#include <fmt/format.h>

#include "server/error_detail.h"

namespace halflight {

absl::Status SequenceState::Hold(NamedParticles brought) {
  LetGo();
  const uint64_t bytes = MemoryBytes(*brought.set);
  const auto growth = backend_.partial_uploads.Grow(inline_memory_, bytes);
  if (growth != ByteBudget::Growth::kDone) {
    return BusyError(v1::ERROR_REASON_UPLOAD_MEMORY_FULL,
                     fmt::format("scene.inline_particles of {} bytes", bytes),
                     backend_.partial_uploads.memory().Allowed(growth, "uploads in progress"));
  }
  inline_ = std::move(brought);
  return absl::OkStatus();
}

void SequenceState::LetGo() {
  inline_.reset();
  inline_memory_.Release();
}

absl::StatusOr<FrameJob> SequenceState::Next(const v1::RenderFrameRequest& request) {
  const v1::Scene& scene = request.scene();
  v1::Scene& merged = *merged_.mutable_scene();
  if (scene.has_inline_particles()) {
    auto brought = ResolveParticles(scene, backend_.store, backend_.limits);
    const absl::Status held = brought.ok() ? Hold(*std::move(brought)) : brought.status();
    if (!held.ok()) {
      return held;
    }
    merged.clear_particles();
  } else if (scene.has_particle_sha256()) {
    merged.set_particle_sha256(scene.particle_sha256());
    LetGo();
  }
  const auto particles =
      inline_.has_value() ? *inline_ : ResolveParticles(merged, backend_.store, backend_.limits);
  if (!particles.ok()) {
    return particles.status();
  }

  if (scene.has_time_offset_s()) {
    merged.set_time_offset_s(scene.time_offset_s());
  }
  if (scene.has_camera()) {
    *merged.mutable_camera() = scene.camera();
  }
  if (scene.has_lighting()) {
    *merged.mutable_lighting() = scene.lighting();
  }
  if (scene.has_material()) {
    *merged.mutable_material() = scene.material();
  }
  if (scene.has_shadow()) {
    *merged.mutable_shadow() = scene.shadow();
  }
  if (scene.has_sampling()) {
    *merged.mutable_sampling() = scene.sampling();
  }
  if (request.outputs_size() > 0) {
    *merged_.mutable_outputs() = request.outputs();
  }
  if (request.has_measure_error()) {
    *merged_.mutable_measure_error() = request.measure_error();
  }
  // Settings and a target end each other.
  if (scene.has_shadow()) {
    merged_.clear_target();
  }
  if (request.has_target()) {
    *merged_.mutable_target() = request.target();
    if (!scene.has_shadow()) {
      merged.clear_shadow();
    }
  }
  merged_.set_request_id(request.request_id());
  merged_.set_priority(request.priority());
  auto job = ConvertFrame(merged_, *particles, backend_.limits, backend_.device);
  if (job.ok() && job->target.has_value()) {
    job->target->knowledge = knowledge_;
  }
  return job;
}

absl::StatusOr<NamedParticles> SequenceState::Particles() {
  if (inline_.has_value()) {
    return *inline_;
  }
  const std::string& sha256 = merged_.scene().particle_sha256();
  if (auto set = backend_.store.Use(sha256)) {
    return NamedParticles{sha256, std::move(set)};
  }
  return ResolveParticles(merged_.scene(), backend_.store, backend_.limits);  // says why not
}

const std::string& SequenceState::SetWanted(const v1::Scene& scene) const {
  return scene.particles_case() == v1::Scene::PARTICLES_NOT_SET ? merged_.scene().particle_sha256()
                                                                : scene.particle_sha256();
}

}  // namespace halflight
