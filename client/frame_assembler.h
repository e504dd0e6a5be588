// Puts a frame together from the messages it arrives in, and believes none of them: order, offsets,
// sizes and digests are checked. Knows nothing of how messages arrive.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "halflight/sha256.h"
#include "halflight/v1/frame.pb.h"

namespace halflight::client {

struct RenderedFrame {
  v1::FrameHeader header;
  std::vector<std::string> outputs;  // encoded, in the order of header.outputs
  std::vector<std::string> sha256;   // of each output, as verified
};

// Takes the messages of one frame. Every error is DATA_LOSS and final.
class FrameAssembler {
 public:
  absl::Status AddHeader(const v1::FrameHeader& header);
  absl::Status AddChunk(const v1::OutputChunk& chunk);
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
  Sha256 sha_;
};

}  // namespace halflight::client
