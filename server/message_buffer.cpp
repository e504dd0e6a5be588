// The wire format is that of https://protobuf.dev/programming-guides/encoding.
#include "server/message_buffer.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include "renderer/field_error.h"

namespace halflight {
namespace {

using google::protobuf::io::CodedOutputStream;

// Of a field whose length goes before its bytes.
constexpr uint32_t Tag(int field) {
  constexpr uint32_t kLengthDelimited = 2;
  return static_cast<uint32_t>(field) << 3U | kLengthDelimited;
}

}  // namespace

absl::Status UnreadableMessage(const google::protobuf::Message& wanted) {
  return FieldError("message", "bytes that are none",
                    fmt::format("a {}", wanted.GetDescriptor()->name()));
}

absl::Status ExcessiveMessage(size_t read_bytes) {
  return FieldError("message", fmt::format("one that takes {} bytes once it is read", read_bytes),
                    fmt::format("at most {} beside particles", kMaxReadBytes));
}

std::string BytesBeforeData(std::string rest, int chunk_field, const v1::OutputChunk& chunk,
                            size_t data_bytes) {
  constexpr uint32_t kDataTag = Tag(v1::OutputChunk::kDataFieldNumber);
  const std::string before_data = chunk.SerializeAsString();
  const auto data_size = static_cast<uint32_t>(data_bytes);
  google::protobuf::io::StringOutputStream appended(&rest);
  {
    CodedOutputStream out(&appended);
    out.WriteTag(Tag(chunk_field));
    const size_t chunk_bytes = before_data.size() + CodedOutputStream::VarintSize32(kDataTag) +
                               CodedOutputStream::VarintSize32(data_size) + data_bytes;
    out.WriteVarint32(static_cast<uint32_t>(chunk_bytes));
    out.WriteString(before_data);
    out.WriteTag(kDataTag);
    out.WriteVarint32(data_size);
  }
  return rest;
}

grpc::ByteBuffer JoinWithoutCopying(const std::string& before, const SharedBytes& data) {
  using Owner = std::shared_ptr<const void>;
  if (data.size() == 0) {
    const grpc::Slice slice(before);
    return {&slice, 1};
  }
  // gRPC only reads what it sends.
  void* const begin = const_cast<char*>(data.view().data());
  const std::array slices{
      grpc::Slice(before),
      grpc::Slice(
          begin, data.size(), [](void* owner) { delete static_cast<Owner*>(owner); },
          new Owner(data.owner()))};
  return {slices.data(), slices.size()};
}

}  // namespace halflight
