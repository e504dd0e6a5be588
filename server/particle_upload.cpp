#include "server/particle_upload.h"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "server/convert/field_checks.h"
#include "server/error_detail.h"
#include "server/status_text.h"

namespace halflight {

ParticleUpload::ParticleUpload(ParticleStore& store, PartialUploads& partial,
                               const ServerLimits& limits, Caller caller)
    : store_(store), partial_(partial), limits_(limits), caller_(std::move(caller)) {}

ParticleUpload::~ParticleUpload() { Keep(); }

absl::Status ParticleUpload::Receive(const v1::UploadParticlesRequest& message) {
  absl::Status status = Take(message);
  if (absl::IsResourceExhausted(status)) {
    Keep();  // there may be room again when the client comes back
  }
  if (!status.ok()) {
    upload_.reset();
    over_ = true;
  }
  return status;
}

absl::Status ParticleUpload::Take(const v1::UploadParticlesRequest& message) {
  if (over_) {
    return FieldError("part", "a message after finish", "end of the stream");
  }
  using Request = v1::UploadParticlesRequest;
  const bool begun = upload_ != nullptr;
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
    AnswerAlreadyPresent();
    return absl::OkStatus();
  }
  // Nobody sends gigabytes for a set that finds no room.
  if (absl::Status room = store_.CheckRoom(*bytes); !room.ok()) {
    return room;
  }
  if (header.resume_offset() == 0) {
    upload_ = std::make_unique<PartialUpload>(header, partial_.memory(), caller_);
    return absl::OkStatus();
  }
  auto kept = partial_.Take(header, caller_.tenant);
  if (!kept.ok()) {
    return kept.status();
  }
  upload_ = *std::move(kept);
  upload_->memory.PassTo(caller_.client());
  resumed_ = true;
  at_ = header.resume_offset();
  return absl::OkStatus();
}

void ParticleUpload::AnswerAlreadyPresent() {
  response_.emplace().set_already_present(true);
  upload_.reset();
  over_ = true;
}

void ParticleUpload::Keep() {
  if (upload_ != nullptr) {
    partial_.Keep(std::move(upload_));
  }
}

absl::Status ParticleUpload::Append(std::string_view bytes) {
  // Another upload of the set may have come to its end.
  if (store_.Touch(upload_->header.sha256())) {
    AnswerAlreadyPresent();
    return absl::OkStatus();
  }
  ParticleAssembler& assembler = upload_->assembler;
  const uint64_t begin = std::exchange(at_, at_ + bytes.size());
  // What is there already, where the client resumes before the end of what is kept.
  bytes.remove_prefix(std::min<uint64_t>(bytes.size(), assembler.received_bytes() - begin));
  // An upload never holds more than the payload, whatever is sent: the assembler refuses the rest.
  if (assembler.received_bytes() + bytes.size() <= assembler.payload_bytes()) {
    const auto growth = partial_.Grow(upload_->memory, bytes.size());
    if (growth != ByteBudget::Growth::kDone) {
      return BusyError(v1::ERROR_REASON_UPLOAD_MEMORY_FULL,
                       fmt::format("{} bytes more", bytes.size()),
                       partial_.memory().Allowed(growth, "uploads in progress"));
    }
  }
  absl::Status taken = assembler.Append(bytes);
  if (resumed_ && absl::IsInvalidArgument(taken)) {
    // A value may be half of what another has sent: who sends all again learns whose it was.
    return WithReason(WithCode(absl::StatusCode::kDataLoss, taken),
                      v1::ERROR_REASON_CHECKSUM_MISMATCH);
  }
  return taken;
}

absl::Status ParticleUpload::Finish(const v1::UploadFinish& finish) {
  const v1::ParticleSetDescription& header = upload_->header;
  if (finish.byte_size() != header.byte_size()) {
    return FieldError("finish.byte_size", fmt::format("{}", finish.byte_size()),
                      fmt::format("{}, as in the header", header.byte_size()));
  }
  if (finish.sha256() != header.sha256()) {
    const size_t bytes = finish.sha256().size();
    return FieldError(
        "finish.sha256",
        bytes == kSha256Bytes ? ToHex(finish.sha256()) : fmt::format("{} bytes", bytes),
        ToHex(header.sha256()) + ", as in the header");
  }
  if (at_ != header.byte_size()) {
    return FieldError("finish", fmt::format("after {} bytes", at_),
                      fmt::format("after {} bytes, as in the header", header.byte_size()));
  }
  if (absl::Status room = store_.CheckRoom(header.byte_size()); !room.ok()) {
    return room;  // what has arrived is kept
  }
  if (!upload_->finished.has_value()) {
    upload_->finished = upload_->assembler.Finish();
  }
  const NamedParticles particles = *upload_->finished;
  if (particles.sha256 != header.sha256()) {
    return WithReason(
        absl::DataLossError(fmt::format("header.sha256: {}, but what arrived has {}",
                                        ToHex(header.sha256()), ToHex(particles.sha256))),
        v1::ERROR_REASON_CHECKSUM_MISMATCH);
  }
  if (absl::Status inserted = store_.Insert(particles.sha256, particles.set); !inserted.ok()) {
    return inserted;  // others were quicker; what has arrived is kept
  }
  partial_.Drop(particles.sha256);
  upload_.reset();
  over_ = true;
  response_.emplace();
  return absl::OkStatus();
}

absl::Status ParticleUpload::AtEndOfStream() {
  if (response_.has_value()) {
    return absl::OkStatus();
  }
  Keep();
  over_ = true;
  return FieldError("part", "the stream ended before finish", "header, chunks, finish");
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
