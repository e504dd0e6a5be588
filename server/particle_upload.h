// The upload of one particle set: header, chunks, finish, in that order, and nothing committed
// unless size and name come out as promised. Knows nothing of gRPC.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "halflight/v1/particles.pb.h"
#include "halflight/v1/scene.pb.h"
#include "server/caller.h"
#include "server/limits.h"
#include "server/partial_uploads.h"
#include "server/particle_assembler.h"
#include "server/particle_store.h"

namespace halflight {

// One thread at a time. After an error the upload is over. Two of one set at once share nothing
// until one of them commits.
class ParticleUpload {
 public:
  // What breaks off is kept in `partial` for the caller's tenant, and goes on from there when the
  // header asks for it.
  ParticleUpload(ParticleStore& store, PartialUploads& partial, const ServerLimits& limits,
                 Caller caller = {});
  // As if the stream had ended.
  ~ParticleUpload();
  ParticleUpload(const ParticleUpload&) = delete;
  ParticleUpload& operator=(const ParticleUpload&) = delete;
  ParticleUpload(ParticleUpload&&) = delete;
  ParticleUpload& operator=(ParticleUpload&&) = delete;

  // The next message of the stream. InvalidArgument, DataLoss or ResourceExhausted as
  // RenderService.UploadParticles says.
  absl::Status Receive(const v1::UploadParticlesRequest& message);

  // The answer, once there is one: after finish, or as soon as the header or a chunk finds that the
  // set is held already.
  [[nodiscard]] const std::optional<v1::UploadParticlesResponse>& response() const {
    return response_;
  }

  // What to say of a stream that has ended: OK only when there is a response. What has arrived
  // without one is kept, to be resumed.
  [[nodiscard]] absl::Status AtEndOfStream();

 private:
  absl::Status Take(const v1::UploadParticlesRequest& message);
  absl::Status Begin(const v1::ParticleSetDescription& header);
  absl::Status Append(std::string_view bytes);
  absl::Status Finish(const v1::UploadFinish& finish);
  void AnswerAlreadyPresent();
  void Keep();

  ParticleStore& store_;
  PartialUploads& partial_;
  const ServerLimits& limits_;
  const Caller caller_;
  std::unique_ptr<PartialUpload> upload_;  // from the header until the upload is over
  uint64_t at_ = 0;                        // where in the payload the next chunk begins
  bool resumed_ = false;                   // on what somebody has sent before
  bool over_ = false;
  std::optional<v1::UploadParticlesResponse> response_;
};

// Builds the set of a request that carries its particles; the errors are those of an upload, with
// field paths from "scene.inline_particles" on.
absl::StatusOr<NamedParticles> BuildInlineParticles(const v1::InlineParticles& particles,
                                                    const ServerLimits& limits);

}  // namespace halflight
