// What the frames of a sequence ask for, whole: a request of a stream need only say what changes,
// but the first one of a new stream has to say everything.
#pragma once

#include <google/protobuf/repeated_field.h>

#include <cstdint>
#include <map>
#include <mutex>

#include "halflight/v1/service.pb.h"

namespace halflight::client {

// May be used from several threads at once.
class SequenceRequests {
 public:
  // The request of frame `index`, with all that it leaves to the frame before; ascending, and again
  // from any frame on that was not taken.
  v1::RenderFrameRequest Add(uint64_t index, const v1::RenderFrameRequest& request);

  // Of a frame that was added and not taken.
  google::protobuf::RepeatedPtrField<v1::Output> OutputsOf(uint64_t index);

  // Frame `index` was taken, and will not be asked for again.
  void Taken(uint64_t index);

 private:
  std::mutex mutex_;
  std::map<uint64_t, v1::RenderFrameRequest> whole_;  // from the last frame taken on
};

}  // namespace halflight::client
