#include "client/frame_assembler.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "halflight/crc32c.h"

namespace halflight::client {

namespace {

// Reserved before the bytes arrive; what a header promises beyond it is believed as it comes.
constexpr uint64_t kMostReserved = uint64_t{64} << 20;

absl::Status CheckOutputs(const v1::FrameHeader& header,
                          const google::protobuf::RepeatedPtrField<v1::Output>& requested) {
  if (header.outputs_size() != requested.size()) {
    return absl::DataLossError(fmt::format("the frame has {} outputs, expected {}",
                                           header.outputs_size(), requested.size()));
  }
  for (int i = 0; i < requested.size(); ++i) {
    const v1::Output& output = header.outputs(i).output();
    const v1::Output& wanted = requested[i];
    if (output.kind() != wanted.kind()) {
      return absl::DataLossError(fmt::format("output {}: kind is {}, expected {}", i,
                                             v1::OutputKind_Name(output.kind()),
                                             v1::OutputKind_Name(wanted.kind())));
    }
    if (wanted.format() != v1::IMAGE_FORMAT_UNSPECIFIED && output.format() != wanted.format()) {
      return absl::DataLossError(fmt::format("output {}: format is {}, expected {}", i,
                                             v1::ImageFormat_Name(output.format()),
                                             v1::ImageFormat_Name(wanted.format())));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckSize(const v1::FrameHeader& header, uint64_t max_frame_bytes) {
  uint64_t left = max_frame_bytes;
  for (int i = 0; i < header.outputs_size(); ++i) {
    const uint64_t size = header.outputs(i).byte_size();
    if (size > left) {
      return absl::OutOfRangeError(
          fmt::format("max_frame_bytes: output {} has {} bytes, after {} of those before it; "
                      "allowed: {} in all",
                      i, size, max_frame_bytes - left, max_frame_bytes));
    }
    left -= size;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status FrameAssembler::AddHeader(
    const v1::FrameHeader& header, const google::protobuf::RepeatedPtrField<v1::Output>& requested,
    uint64_t max_frame_bytes) {
  if (started_) {
    return absl::DataLossError("a second header came within one frame");
  }
  if (absl::Status status = CheckOutputs(header, requested); !status.ok()) {
    return status;
  }
  if (absl::Status status = CheckSize(header, max_frame_bytes); !status.ok()) {
    return status;
  }
  started_ = true;
  frame_.header = header;
  SealComplete();
  return absl::OkStatus();
}

void FrameAssembler::SealComplete() {
  while (complete_.size() < static_cast<size_t>(frame_.header.outputs_size())) {
    const uint64_t size = frame_.header.outputs(static_cast<int>(complete_.size())).byte_size();
    if (frame_.outputs.size() == complete_.size()) {
      frame_.outputs.emplace_back();
      frame_.outputs.back().reserve(std::min(size, kMostReserved));
    }
    if (frame_.outputs.back().size() < size) {
      return;
    }
    complete_.push_back(std::exchange(crc32c_, 0));
  }
}

absl::Status FrameAssembler::AddChunk(const v1::OutputChunk& chunk,
                                      const std::vector<std::string_view>& data) {
  if (!started_) {
    return absl::DataLossError("a chunk came before the frame's header");
  }
  const size_t current = complete_.size();
  if (chunk.output_index() != current ||
      current == static_cast<size_t>(frame_.header.outputs_size())) {
    return absl::DataLossError(
        fmt::format("a chunk of output {} came where output {} of {} was to go on",
                    chunk.output_index(), current, frame_.header.outputs_size()));
  }
  std::string& output = frame_.outputs[current];
  const uint64_t size = frame_.header.outputs(static_cast<int>(current)).byte_size();
  const size_t bytes =
      std::accumulate(data.begin(), data.end(), size_t{0},
                      [](size_t sum, std::string_view piece) { return sum + piece.size(); });
  if (chunk.offset() != output.size() || bytes > size - output.size()) {
    return absl::DataLossError(fmt::format(
        "output {}: a chunk of {} bytes came at offset {}, expected offset {} of {} bytes in all",
        current, bytes, chunk.offset(), output.size(), size));
  }
  for (const std::string_view piece : data) {
    output += piece;
    crc32c_ = ExtendCrc32c(crc32c_, piece);  // while the processor has it near
  }
  SealComplete();
  return absl::OkStatus();
}

absl::Status FrameAssembler::AddTrailer(const v1::FrameTrailer& trailer) {
  if (!started_) {
    return absl::DataLossError("a trailer came before the frame's header");
  }
  const auto outputs = static_cast<size_t>(frame_.header.outputs_size());
  if (complete_.size() != outputs) {
    const size_t current = complete_.size();
    return absl::DataLossError(
        fmt::format("output {}: {} of {} bytes came before the trailer", current,
                    frame_.outputs[current].size(),
                    frame_.header.outputs(static_cast<int>(current)).byte_size()));
  }
  if (static_cast<size_t>(trailer.output_crc32c_size()) != outputs) {
    return absl::DataLossError(fmt::format("the trailer has {} checksums, expected {}",
                                           trailer.output_crc32c_size(), outputs));
  }
  for (size_t i = 0; i < outputs; ++i) {
    const uint32_t promised = trailer.output_crc32c(static_cast<int>(i));
    if (promised != complete_[i]) {
      return absl::DataLossError(fmt::format(
          "output {}: CRC-32C of the bytes is {:08x}, expected {:08x}", i, complete_[i], promised));
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
