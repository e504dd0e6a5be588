// A finished frame cut into the messages it is sent as: header, chunks of every output, trailer.
// Copies one chunk at a time; sends nothing.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "server/frame_pipeline.h"

namespace halflight {

// As frame.proto promises.
inline constexpr size_t kChunkBytes = size_t{256} << 10U;

class FrameMessages {
 public:
  explicit FrameMessages(std::shared_ptr<const EncodedFrame> frame) : frame_(std::move(frame)) {}

  // Puts the next part into a RenderFrameResponse or RenderSequenceResponse, whose memory is used
  // again; false after the trailer.
  template <typename Response>
  bool Next(Response& message) {
    switch (next_) {
      case Part::kHeader:
        *message.mutable_header() = frame_->header;
        next_ = Part::kChunk;
        SkipEmptyOutputs();
        return true;
      case Part::kChunk: {
        const std::string& bytes = frame_->outputs[output_];
        const size_t size = std::min(kChunkBytes, bytes.size() - offset_);
        v1::OutputChunk& chunk = *message.mutable_chunk();
        chunk.set_output_index(static_cast<uint32_t>(output_));
        chunk.set_offset(offset_);
        chunk.set_data(bytes.data() + offset_, size);
        offset_ += size;
        SkipEmptyOutputs();
        return true;
      }
      case Part::kTrailer:
        *message.mutable_trailer() = frame_->trailer;
        next_ = Part::kEnd;
        return true;
      case Part::kEnd:
        break;
    }
    return false;
  }

 private:
  enum class Part : uint8_t { kHeader, kChunk, kTrailer, kEnd };

  // To the next byte to send, or the trailer where there is none.
  void SkipEmptyOutputs() {
    while (output_ < frame_->outputs.size() && offset_ == frame_->outputs[output_].size()) {
      ++output_;
      offset_ = 0;
    }
    if (output_ == frame_->outputs.size()) {
      next_ = Part::kTrailer;
    }
  }

  std::shared_ptr<const EncodedFrame> frame_;
  Part next_ = Part::kHeader;
  size_t output_ = 0;
  size_t offset_ = 0;
};

}  // namespace halflight
