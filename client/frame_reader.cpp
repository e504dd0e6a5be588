// The wire format is that of https://protobuf.dev/programming-guides/encoding.
#include "client/frame_reader.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <cstdint>
#include <type_traits>

namespace halflight::client {

namespace {

using google::protobuf::io::CodedInputStream;

constexpr uint32_t VarintTag(int field) { return static_cast<uint32_t>(field) << 3U; }
constexpr uint32_t BytesTag(int field) { return VarintTag(field) | 2U; }

// Reads the field that may come next and has come where `tag` is its; sets `tag` to the next one.
template <typename Number>
bool ReadIfNext(CodedInputStream& in, uint32_t expected, uint32_t& tag, Number& value) {
  if (tag != expected) {
    return true;
  }
  uint64_t read = 0;
  if (!in.ReadVarint64(&read)) {
    return false;
  }
  value = static_cast<Number>(read);
  tag = in.ReadTag();
  return true;
}

// Reads a field's length, which has to reach to the end of the message.
bool ReadLastLength(CodedInputStream& in, int64_t message_bytes, uint32_t& length) {
  return in.ReadVarint32(&length) && length == message_bytes - in.CurrentPosition();
}

// Reads a message that is a chunk, has its fields in order and nothing after the data; false for
// any other.
template <typename Response>
bool ReadChunk(grpc::ByteBuffer& bytes, IncomingMessage<Response>& incoming) {
  grpc::ProtoBufferReader reader(&bytes);
  CodedInputStream in(&reader);
  const auto message_bytes = static_cast<int64_t>(bytes.Length());

  uint32_t tag = in.ReadTag();
  uint64_t frame_index = 0;
  if constexpr (std::is_same_v<Response, v1::RenderSequenceResponse>) {
    if (!ReadIfNext(in, VarintTag(Response::kFrameIndexFieldNumber), tag, frame_index)) {
      return false;
    }
  }
  uint32_t length = 0;
  if (tag != BytesTag(Response::kChunkFieldNumber) || !ReadLastLength(in, message_bytes, length)) {
    return false;
  }
  uint32_t output_index = 0;
  uint64_t offset = 0;
  tag = in.ReadTag();
  if (!ReadIfNext(in, VarintTag(v1::OutputChunk::kOutputIndexFieldNumber), tag, output_index) ||
      !ReadIfNext(in, VarintTag(v1::OutputChunk::kOffsetFieldNumber), tag, offset) ||
      tag != BytesTag(v1::OutputChunk::kDataFieldNumber) ||
      !ReadLastLength(in, message_bytes, length)) {
    return false;
  }

  while (length > 0) {
    const void* piece = nullptr;
    int size = 0;
    if (!in.GetDirectBufferPointer(&piece, &size)) {
      return false;
    }
    const int taken = static_cast<int>(std::min<int64_t>(size, length));
    incoming.chunk_data.emplace_back(static_cast<const char*>(piece), taken);
    length -= static_cast<uint32_t>(taken);
    in.Skip(taken);
  }
  if constexpr (std::is_same_v<Response, v1::RenderSequenceResponse>) {
    incoming.message.set_frame_index(frame_index);
  }
  v1::OutputChunk& chunk = *incoming.message.mutable_chunk();
  chunk.set_output_index(output_index);
  chunk.set_offset(offset);
  return true;
}

}  // namespace

template <typename Response>
absl::Status Read(grpc::ByteBuffer& bytes, IncomingMessage<Response>& incoming) {
  incoming.message.Clear();
  incoming.chunk_data.clear();
  if (ReadChunk(bytes, incoming)) {
    return absl::OkStatus();
  }
  incoming.chunk_data.clear();
  grpc::ProtoBufferReader reader(&bytes);
  if (!incoming.message.ParseFromZeroCopyStream(&reader)) {
    return absl::DataLossError("a message came that is no part of a frame");
  }
  if (incoming.message.has_chunk()) {
    incoming.chunk_data.emplace_back(incoming.message.chunk().data());
  }
  return absl::OkStatus();
}

template absl::Status Read(grpc::ByteBuffer&, IncomingMessage<v1::RenderFrameResponse>&);
template absl::Status Read(grpc::ByteBuffer&, IncomingMessage<v1::RenderSequenceResponse>&);

}  // namespace halflight::client
