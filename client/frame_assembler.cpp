#include "client/frame_assembler.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace halflight::client {

namespace {

// Reserved before the bytes arrive; what a header promises beyond it is believed as it comes.
constexpr uint64_t kMostReserved = uint64_t{64} << 20;

}  // namespace

absl::Status FrameAssembler::AddHeader(const v1::FrameHeader& header) {
  if (started_) {
    return absl::DataLossError("a second header came within one frame");
  }
  started_ = true;
  frame_.header = header;
  SealComplete();
  return absl::OkStatus();
}

void FrameAssembler::SealComplete() {
  while (frame_.sha256.size() < static_cast<size_t>(frame_.header.outputs_size())) {
    const uint64_t size = frame_.header.outputs(static_cast<int>(frame_.sha256.size())).byte_size();
    if (frame_.outputs.size() == frame_.sha256.size()) {
      frame_.outputs.emplace_back();
      frame_.outputs.back().reserve(std::min(size, kMostReserved));
    }
    if (frame_.outputs.back().size() < size) {
      return;
    }
    frame_.sha256.push_back(std::exchange(sha_, Sha256()).Finish());
  }
}

absl::Status FrameAssembler::AddChunk(const v1::OutputChunk& chunk) {
  if (!started_) {
    return absl::DataLossError("a chunk came before the frame's header");
  }
  const size_t current = frame_.sha256.size();
  if (chunk.output_index() != current ||
      current == static_cast<size_t>(frame_.header.outputs_size())) {
    return absl::DataLossError(
        fmt::format("a chunk of output {} came where output {} of {} was to go on",
                    chunk.output_index(), current, frame_.header.outputs_size()));
  }
  std::string& output = frame_.outputs[current];
  const uint64_t size = frame_.header.outputs(static_cast<int>(current)).byte_size();
  if (chunk.offset() != output.size() || chunk.data().size() > size - output.size()) {
    return absl::DataLossError(fmt::format(
        "output {}: a chunk of {} bytes came at offset {}, expected offset {} of {} bytes in all",
        current, chunk.data().size(), chunk.offset(), output.size(), size));
  }
  output += chunk.data();
  sha_.Update(chunk.data());
  SealComplete();
  return absl::OkStatus();
}

absl::Status FrameAssembler::AddTrailer(const v1::FrameTrailer& trailer) {
  if (!started_) {
    return absl::DataLossError("a trailer came before the frame's header");
  }
  const auto outputs = static_cast<size_t>(frame_.header.outputs_size());
  if (frame_.sha256.size() != outputs) {
    const size_t current = frame_.sha256.size();
    return absl::DataLossError(
        fmt::format("output {}: {} of {} bytes came before the trailer", current,
                    frame_.outputs[current].size(),
                    frame_.header.outputs(static_cast<int>(current)).byte_size()));
  }
  if (static_cast<size_t>(trailer.output_sha256_size()) != outputs) {
    return absl::DataLossError(fmt::format("the trailer has {} digests, expected {}",
                                           trailer.output_sha256_size(), outputs));
  }
  for (size_t i = 0; i < outputs; ++i) {
    const std::string& promised = trailer.output_sha256(static_cast<int>(i));
    if (promised != frame_.sha256[i]) {
      return absl::DataLossError(fmt::format("output {}: SHA-256 of the bytes is {}, expected {}",
                                             i, ToHex(frame_.sha256[i]), ToHex(promised)));
    }
  }
  return absl::OkStatus();
}

RenderedFrame FrameAssembler::Take() {
  RenderedFrame frame = std::move(frame_);
  *this = FrameAssembler();
  return frame;
}

}  // namespace halflight::client
