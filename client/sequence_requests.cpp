#include "client/sequence_requests.h"

#include <google/protobuf/message.h>

#include <vector>

namespace halflight::client {

namespace {

// Puts each field that `given` has in the place of that of `kept`.
void Replace(const google::protobuf::Message& given, google::protobuf::Message& kept) {
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  given.GetReflection()->ListFields(given, &fields);
  for (const google::protobuf::FieldDescriptor* field : fields) {
    kept.GetReflection()->ClearField(&kept, field);
  }
  kept.MergeFrom(given);
}

// By the rule of RenderSequenceRequest.
v1::RenderFrameRequest Whole(const v1::RenderFrameRequest& before,
                             const v1::RenderFrameRequest& request) {
  v1::RenderFrameRequest whole = before;
  whole.clear_request_id();
  whole.clear_priority();
  if (request.scene().has_shadow() || request.has_target()) {
    whole.mutable_scene()->clear_shadow();  // each ends the other
    whole.clear_target();
  }
  v1::Scene scene = whole.scene();
  Replace(request.scene(), scene);
  Replace(request, whole);
  *whole.mutable_scene() = std::move(scene);
  return whole;
}

}  // namespace

v1::RenderFrameRequest SequenceRequests::Add(uint64_t index,
                                             const v1::RenderFrameRequest& request) {
  const std::lock_guard lock(mutex_);
  return whole_[index] = index == 0 ? request : Whole(whole_[index - 1], request);
}

google::protobuf::RepeatedPtrField<v1::Output> SequenceRequests::OutputsOf(uint64_t index) {
  const std::lock_guard lock(mutex_);
  return whole_[index].outputs();
}

void SequenceRequests::Taken(uint64_t index) {
  const std::lock_guard lock(mutex_);
  whole_.erase(whole_.begin(), whole_.lower_bound(index));
}

}  // namespace halflight::client
