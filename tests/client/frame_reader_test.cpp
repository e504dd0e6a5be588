// What is read without copying against what Protobuf reads: of messages as halflightd writes them,
// of all others, and of damaged ones.
#include "client/frame_reader.h"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

namespace halflight::client {
namespace {

// One of its own, however short: gRPC joins those that it has copied.
grpc::Slice SliceOf(std::string bytes) {
  auto* const held = new std::string(std::move(bytes));
  return {held->data(), held->size(), [](void* owner) { delete static_cast<std::string*>(owner); },
          held};
}

// Cut before each of `cuts`, ascending, as it may arrive.
grpc::ByteBuffer BufferOf(const std::string& bytes, const std::vector<size_t>& cuts = {}) {
  std::vector<grpc::Slice> slices;
  size_t from = 0;
  for (const size_t cut : cuts) {
    slices.push_back(SliceOf(bytes.substr(from, cut - from)));
    from = cut;
  }
  slices.push_back(SliceOf(bytes.substr(from)));
  return {slices.data(), slices.size()};
}

// Whether Read says of these bytes what Protobuf says of them.
template <typename Response>
void ExpectAsProtobuf(const std::string& bytes, const std::vector<size_t>& cuts = {}) {
  Response expected;
  const bool is_message = expected.ParseFromString(bytes);
  grpc::ByteBuffer buffer = BufferOf(bytes, cuts);
  IncomingMessage<Response> incoming;
  const absl::Status status = Read(buffer, incoming);
  ASSERT_EQ(status.ok(), is_message) << testing::PrintToString(bytes);
  if (!is_message) {
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    return;
  }
  ASSERT_EQ(incoming.message.part_case(), expected.part_case());
  std::string data;
  for (const std::string_view piece : incoming.chunk_data) {
    data += piece;
  }
  EXPECT_EQ(data, expected.chunk().data());
  if (expected.has_chunk()) {
    incoming.message.mutable_chunk()->clear_data();
    expected.mutable_chunk()->clear_data();
  }
  EXPECT_EQ(incoming.message.SerializeAsString(), expected.SerializeAsString());
}

v1::RenderSequenceResponse Chunk() {
  v1::RenderSequenceResponse message;
  message.set_frame_index(300);
  message.mutable_chunk()->set_output_index(2);
  message.mutable_chunk()->set_offset(262144);
  message.mutable_chunk()->set_data("the bytes of it");
  return message;
}

v1::RenderFrameResponse ChunkOfFrame() {
  v1::RenderFrameResponse message;
  *message.mutable_chunk() = Chunk().chunk();
  return message;
}

// A field of its own message, as Protobuf writes it: tag, length, bytes.
std::string Field(int number, const std::string& bytes) {
  return std::string{static_cast<char>(number << 3U | 2U), static_cast<char>(bytes.size())} + bytes;
}

TEST(FrameReader, LeavesDataWhereItLies) {
  const std::string bytes = ChunkOfFrame().SerializeAsString();
  const size_t data_begin = bytes.size() - ChunkOfFrame().chunk().data().size();
  grpc::ByteBuffer buffer = BufferOf(bytes, {data_begin + 4});
  std::vector<grpc::Slice> slices;
  ASSERT_TRUE(buffer.Dump(&slices).ok());
  IncomingMessage<v1::RenderFrameResponse> incoming;
  ASSERT_TRUE(Read(buffer, incoming).ok());
  ASSERT_THAT(incoming.chunk_data, testing::ElementsAre("the ", "bytes of it"));
  EXPECT_TRUE(incoming.message.chunk().data().empty());
  EXPECT_EQ(incoming.chunk_data[1].data(), reinterpret_cast<const char*>(slices[1].begin()));
}

TEST(FrameReader, ReadsEveryPartHoweverItIsCut) {
  std::vector<v1::RenderSequenceResponse> messages(3, Chunk());
  messages[0].mutable_header()->add_outputs()->set_byte_size(77);
  messages[2].mutable_trailer()->add_output_crc32c(0xDEADBEEF);
  messages.emplace_back().mutable_chunk()->set_data("at 0 of 0");
  messages.emplace_back().mutable_chunk();
  messages.emplace_back();
  for (const v1::RenderSequenceResponse& message : messages) {
    const std::string bytes = message.SerializeAsString();
    for (size_t cut = 0; cut <= bytes.size(); ++cut) {
      ExpectAsProtobuf<v1::RenderSequenceResponse>(bytes, {cut});
      ExpectAsProtobuf<v1::RenderSequenceResponse>(bytes, {cut / 2, cut});
    }
  }
  ExpectAsProtobuf<v1::RenderFrameResponse>(ChunkOfFrame().SerializeAsString());
}

TEST(FrameReader, TakesFieldsInAnyOrderRepeatedAndUnknown) {
  v1::OutputChunk place;
  place.set_output_index(1);
  place.set_offset(5);
  v1::OutputChunk data;
  data.set_data("data");
  const std::string index_first = place.SerializeAsString();
  const std::string data_first = data.SerializeAsString() + index_first;
  const std::string unknown = Field(15, "later");
  const std::string frame_index = "\x08\x07";
  for (const std::string& chunk :
       {index_first, data_first, index_first + data.SerializeAsString() + unknown,
        unknown + index_first + data.SerializeAsString(),
        index_first + index_first + data.SerializeAsString(),
        index_first + data.SerializeAsString() + data.SerializeAsString()}) {
    for (const std::string& bytes :
         {Field(3, chunk), frame_index + Field(3, chunk), Field(3, chunk) + frame_index,
          unknown + Field(3, chunk), Field(3, chunk) + unknown, Field(3, chunk) + Field(3, chunk),
          Field(3, chunk) + Field(4, ""), Field(2, "") + Field(3, chunk)}) {
      ExpectAsProtobuf<v1::RenderSequenceResponse>(bytes);
    }
    ExpectAsProtobuf<v1::RenderFrameResponse>(Field(2, chunk));
    ExpectAsProtobuf<v1::RenderFrameResponse>(Field(2, chunk) + unknown);
  }
}

TEST(FrameReader, JudgesDamageAsProtobufDoes) {
  const std::string of_sequence = Chunk().SerializeAsString();
  const std::string of_frame = ChunkOfFrame().SerializeAsString();
  for (const std::string& bytes : {of_sequence, of_frame}) {
    for (size_t at = 0; at < bytes.size(); ++at) {
      ExpectAsProtobuf<v1::RenderSequenceResponse>(bytes.substr(0, at));
      ExpectAsProtobuf<v1::RenderFrameResponse>(bytes.substr(0, at));
      for (unsigned value = 0; value < 256; ++value) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(value);
        ExpectAsProtobuf<v1::RenderSequenceResponse>(damaged);
        ExpectAsProtobuf<v1::RenderFrameResponse>(damaged);
      }
    }
  }
}

TEST(FrameReader, KeepsNothingOfTheMessageBefore) {
  IncomingMessage<v1::RenderSequenceResponse> incoming;
  grpc::ByteBuffer chunk = BufferOf(Chunk().SerializeAsString());
  ASSERT_TRUE(Read(chunk, incoming).ok());
  v1::RenderSequenceResponse trailer;
  trailer.mutable_trailer();
  grpc::ByteBuffer bytes = BufferOf(trailer.SerializeAsString());
  ASSERT_TRUE(Read(bytes, incoming).ok());
  EXPECT_EQ(incoming.message.frame_index(), 0U);
  EXPECT_TRUE(incoming.message.has_trailer());
  EXPECT_TRUE(incoming.chunk_data.empty());
}

}  // namespace
}  // namespace halflight::client
