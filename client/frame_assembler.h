// Puts a frame together from the messages it arrives in, and believes none of them: order, offsets,
// sizes and checksums are checked. Knows nothing of how messages arrive.
#pragma once

#include <google/protobuf/repeated_field.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "halflight/v1/frame.pb.h"

namespace halflight::client {

struct RenderedFrame {
  v1::FrameHeader header;
  std::vector<std::string> outputs;  // encoded, in the order of header.outputs
};

// Takes the messages of one frame. Every error is final, and DATA_LOSS but for one.
class FrameAssembler {
 public:
  // The header of a frame that was to have the outputs `requested`. OUT_OF_RANGE where they come to
  // more than `max_frame_bytes`.
  absl::Status AddHeader(const v1::FrameHeader& header,
                         const google::protobuf::RepeatedPtrField<v1::Output>& requested,
                         uint64_t max_frame_bytes);
  // `chunk` without its data, which comes in pieces.
  absl::Status AddChunk(const v1::OutputChunk& chunk, const std::vector<std::string_view>& data);
  // Completes the frame.
  absl::Status AddTrailer(const v1::FrameTrailer& trailer);

  [[nodiscard]] bool started() const { return started_; }
  // Valid after AddTrailer said OK; leaves an assembler for the next frame.
  RenderedFrame Take();

 private:
  // Seals the outputs that are complete, up to the one that the next chunk belongs to.
  void SealComplete();

  bool started_ = false;
  RenderedFrame frame_;
  uint32_t crc32c_ = 0;             // of what has come of the next output
  std::vector<uint32_t> complete_;  // of each output that is complete
};

}  // namespace halflight::client
