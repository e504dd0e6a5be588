#include "server/particle_upload.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include "server/convert/field_checks.h"
#include "server/error_detail.h"
#include "server/status_text.h"

namespace halflight {

ParticleUpload::ParticleUpload(ParticleStore& store, ByteBudget& memory, const ServerLimits& limits)
    : store_(store), limits_(limits), memory_(memory) {}

absl::Status ParticleUpload::Receive(const v1::UploadParticlesRequest& message) {
  if (response_.has_value()) {
    return FieldError("part", "a message after finish", "end of the stream");
  }
  using Request = v1::UploadParticlesRequest;
  const bool begun = assembler_.has_value();
  if (!begun && message.part_case() != Request::kHeader) {
    return FieldError("part", "no header yet", "header first");
  }
  switch (message.part_case()) {
    case Request::kHeader:
      return begun ? FieldError("part", "a second header", "chunk or finish after the header")
                   : Begin(message.header());
    case Request::kChunk:
      return Append(message.chunk());
    case Request::kFinish:
      return Finish(message.finish());
    case Request::PART_NOT_SET:
      break;
  }
  return FieldError("part", "unset", "header, chunk or finish");
}

absl::Status ParticleUpload::Begin(const v1::ParticleSetDescription& header) {
  const auto bytes = CheckedPayloadBytes(header.layout(), "header.layout", limits_);
  if (!bytes.ok()) {
    return bytes.status();
  }
  if (header.byte_size() != *bytes) {
    return FieldError("header.byte_size", fmt::format("{}", header.byte_size()),
                      fmt::format("{}, as the layout asks for", *bytes));
  }
  if (header.sha256().size() != kSha256Bytes) {
    return FieldError("header.sha256", fmt::format("{} bytes", header.sha256().size()),
                      fmt::format("{} bytes", kSha256Bytes));
  }
  if (store_.Touch(header.sha256())) {
    response_.emplace().set_already_present(true);
    return absl::OkStatus();
  }
  header_ = header;
  assembler_.emplace(header_.layout(), *bytes);
  return absl::OkStatus();
}

absl::Status ParticleUpload::Append(std::string_view bytes) {
  // An upload never holds more than the payload, whatever is sent: the assembler refuses the rest.
  if (assembler_->received_bytes() + bytes.size() <= assembler_->payload_bytes() &&
      !memory_.Grow(bytes.size())) {
    return BusyError(v1::ERROR_REASON_UPLOAD_MEMORY_FULL,
                     "the memory for uploads in progress is used up: retry later");
  }
  return assembler_->Append(bytes);
}

absl::Status ParticleUpload::Finish(const v1::UploadFinish& finish) {
  if (finish.byte_size() != header_.byte_size()) {
    return FieldError("finish.byte_size", fmt::format("{}", finish.byte_size()),
                      fmt::format("{}, as in the header", header_.byte_size()));
  }
  if (finish.sha256() != header_.sha256()) {
    return FieldError("finish.sha256", ToHex(finish.sha256()),
                      ToHex(header_.sha256()) + ", as in the header");
  }
  if (assembler_->received_bytes() != header_.byte_size()) {
    return FieldError("finish", fmt::format("after {} bytes", assembler_->received_bytes()),
                      fmt::format("after {} bytes, as in the header", header_.byte_size()));
  }
  NamedParticles particles = assembler_->Finish();
  if (particles.sha256 != header_.sha256()) {
    return WithReason(
        absl::DataLossError(fmt::format("header.sha256: {}, but what arrived has {}",
                                        ToHex(header_.sha256()), ToHex(particles.sha256))),
        v1::ERROR_REASON_CHECKSUM_MISMATCH);
  }
  store_.Insert(particles.sha256, std::move(particles.set));
  memory_.Release();
  response_.emplace();
  return absl::OkStatus();
}

absl::Status ParticleUpload::AtEndOfStream() const {
  if (response_.has_value()) {
    return absl::OkStatus();
  }
  return FieldError("part", "the stream ended (or a message could not be read) before finish",
                    "header, chunks, finish");
}

absl::StatusOr<NamedParticles> BuildInlineParticles(const v1::InlineParticles& particles,
                                                    const ServerLimits& limits) {
  const std::string path = "scene.inline_particles";
  const auto bytes = CheckedPayloadBytes(particles.layout(), path + ".layout", limits);
  if (!bytes.ok()) {
    return bytes.status();
  }
  if (particles.payload().size() != *bytes) {
    return FieldError(path + ".payload", fmt::format("{} bytes", particles.payload().size()),
                      fmt::format("{} bytes, as the layout asks for", *bytes));
  }
  ParticleAssembler assembler(particles.layout(), *bytes);
  if (const absl::Status status = assembler.Append(particles.payload()); !status.ok()) {
    return Within(path + ".", status);
  }
  return assembler.Finish();
}

}  // namespace halflight
