// Messages without copies against Protobuf's own bytes, and who keeps a chunk's data alive.
#include "server/message_buffer.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "halflight/v1/service.pb.h"

namespace halflight {
namespace {

std::string Flat(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(buffer.Dump(&slices).ok());
  std::string flat;
  for (const grpc::Slice& slice : slices) {
    flat.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return flat;
}

// Numbers whose varints are of every length, absent where 0.
constexpr uint64_t kNumbers[] = {0, 1, 127, 128, 1U << 20U, 0xFFFFFFFFU, uint64_t{1} << 63U};

template <typename Response>
void ExpectProtobufsBytes(Response message) {
  const SharedBytes bytes(std::string(size_t{256} << 10U, 'p'));
  for (const uint64_t number : kNumbers) {
    for (const size_t size : {0, 1, 100, 127, 128, 16383, 16384, 262144}) {
      OutgoingMessage<Response> outgoing{message, bytes.Part(0, size)};
      v1::OutputChunk& chunk = *outgoing.message.mutable_chunk();
      chunk.set_output_index(static_cast<uint32_t>(number));
      chunk.set_offset(number);
      const std::string flat = Flat(ToByteBuffer(outgoing));
      chunk.set_data(std::string(outgoing.chunk_data.view()));
      if (size > 0) {
        EXPECT_TRUE(flat == outgoing.message.SerializeAsString()) << number << ", " << size;
      }
      Response parsed;
      ASSERT_TRUE(parsed.ParseFromString(flat));
      EXPECT_EQ(parsed.SerializeAsString(), outgoing.message.SerializeAsString());
    }
  }
  message.mutable_header()->add_outputs()->set_byte_size(12345);
  EXPECT_EQ(Flat(ToByteBuffer(OutgoingMessage<Response>{message, {}})),
            message.SerializeAsString());
  message.mutable_trailer()->add_output_crc32c(0xDEADBEEF);
  EXPECT_EQ(Flat(ToByteBuffer(OutgoingMessage<Response>{message, {}})),
            message.SerializeAsString());
}

TEST(MessageBuffer, HoldsTheBytesThatProtobufWrites) {
  ExpectProtobufsBytes(v1::RenderFrameResponse());
  for (const uint64_t index : kNumbers) {
    v1::RenderSequenceResponse message;
    message.set_frame_index(index);
    ExpectProtobufsBytes(message);
  }
}

TEST(MessageBuffer, SendsDataFromWhereItLiesAndKeepsItAlive) {
  auto bytes = std::make_shared<const std::string>(100000, 'x');
  const std::weak_ptr<const std::string> watched = bytes;
  OutgoingMessage<v1::RenderFrameResponse> outgoing{{},
                                                    SharedBytes(bytes, *bytes).Part(1000, 50000)};
  outgoing.message.mutable_chunk()->set_offset(1000);
  const char* const data = outgoing.chunk_data.view().data();
  bytes.reset();
  {
    const grpc::ByteBuffer buffer = ToByteBuffer(outgoing);
    outgoing = {};
    ASSERT_FALSE(watched.expired());
    std::vector<grpc::Slice> slices;
    ASSERT_TRUE(buffer.Dump(&slices).ok());
    ASSERT_EQ(slices.size(), 2U);
    EXPECT_EQ(reinterpret_cast<const char*>(slices[1].begin()), data);
    EXPECT_EQ(slices[1].size(), 50000U);
  }
  EXPECT_TRUE(watched.expired());
}

}  // namespace
}  // namespace halflight
