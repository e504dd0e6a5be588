// A finished frame cut into the messages it is sent as: header, chunks of every output, trailer.
// Checksums one chunk at a time, so that the peer receives and checks one chunk while the next is
// made ready; copies no output and sends nothing.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "halflight/crc32c.h"
#include "server/frame_pipeline.h"
#include "server/handlers/sink.h"

namespace halflight {

// As frame.proto promises.
inline constexpr size_t kChunkBytes = size_t{256} << 10U;

class FrameMessages {
 public:
  explicit FrameMessages(std::shared_ptr<const EncodedFrame> frame) : frame_(std::move(frame)) {}

  // Since there was something to send.
  [[nodiscard]] std::chrono::steady_clock::duration age() const {
    return std::chrono::steady_clock::now() - begin_;
  }

  // Puts the next part into a RenderFrameResponse or RenderSequenceResponse, whose memory is used
  // again; false after the trailer.
  template <typename Response>
  bool Next(OutgoingMessage<Response>& outgoing) {
    Response& message = outgoing.message;
    outgoing.chunk_data = {};
    switch (next_) {
      case Part::kHeader:
        *message.mutable_header() = frame_->header;
        next_ = Part::kChunk;
        SealComplete();
        return true;
      case Part::kChunk: {
        v1::OutputChunk& chunk = *message.mutable_chunk();
        chunk.set_output_index(static_cast<uint32_t>(output_));
        chunk.set_offset(offset_);
        outgoing.chunk_data = frame_->outputs[output_].Part(offset_, kChunkBytes);
        crc32c_ = ExtendCrc32c(crc32c_, outgoing.chunk_data.view());
        offset_ += outgoing.chunk_data.size();
        SealComplete();
        return true;
      }
      case Part::kTrailer:
        *message.mutable_trailer() = trailer_;
        next_ = Part::kEnd;
        return true;
      case Part::kEnd:
        break;
    }
    return false;
  }

 private:
  enum class Part : uint8_t { kHeader, kChunk, kTrailer, kEnd };

  // Seals the outputs of which all is sent, up to the next byte to send, or to the trailer where
  // there is none.
  void SealComplete() {
    while (output_ < frame_->outputs.size() && offset_ == frame_->outputs[output_].size()) {
      trailer_.add_output_crc32c(std::exchange(crc32c_, 0));
      ++output_;
      offset_ = 0;
    }
    if (output_ == frame_->outputs.size()) {
      next_ = Part::kTrailer;
    }
  }

  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::shared_ptr<const EncodedFrame> frame_;
  Part next_ = Part::kHeader;
  size_t output_ = 0;
  size_t offset_ = 0;
  uint32_t crc32c_ = 0;  // of the output that is being sent
  v1::FrameTrailer trailer_;
};

}  // namespace halflight
