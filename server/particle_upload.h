// The upload of one particle set: header, chunks, finish, in that order, and nothing kept unless
// size and name come out as promised. Knows nothing of gRPC.
#pragma once

#include <optional>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "halflight/v1/particles.pb.h"
#include "halflight/v1/scene.pb.h"
#include "server/byte_budget.h"
#include "server/limits.h"
#include "server/particle_assembler.h"
#include "server/particle_store.h"

namespace halflight {

// One thread at a time. After an error the upload is over.
class ParticleUpload {
 public:
  // What all uploads in progress hold together is taken from `memory`.
  ParticleUpload(ParticleStore& store, ByteBudget& memory, const ServerLimits& limits);

  // The next message of the stream. InvalidArgument, DataLoss or ResourceExhausted as
  // RenderService.UploadParticles says.
  absl::Status Receive(const v1::UploadParticlesRequest& message);

  // The answer, once there is one: after finish, or as soon as the header names a set that is held
  // already.
  [[nodiscard]] const std::optional<v1::UploadParticlesResponse>& response() const {
    return response_;
  }

  // What to say of a stream that has ended: OK only when there is a response.
  [[nodiscard]] absl::Status AtEndOfStream() const;

 private:
  absl::Status Begin(const v1::ParticleSetDescription& header);
  absl::Status Append(std::string_view bytes);
  absl::Status Finish(const v1::UploadFinish& finish);

  ParticleStore& store_;
  const ServerLimits& limits_;
  ByteBudget::Share memory_;
  v1::ParticleSetDescription header_;
  std::optional<ParticleAssembler> assembler_;
  std::optional<v1::UploadParticlesResponse> response_;
};

// Builds the set of a request that carries its particles; the errors are those of an upload, with
// field paths from "scene.inline_particles" on.
absl::StatusOr<NamedParticles> BuildInlineParticles(const v1::InlineParticles& particles,
                                                    const ServerLimits& limits);

}  // namespace halflight
