// Mutation of messages by their fields, for libFuzzer: of bytes alone it hardly ever finds out
// which fields there are.
#pragma once

#include <random>

#include <google/protobuf/message.h>

namespace halflight::fuzz {

// Changes one field of the message, or of a message in it: sets it to another value, mostly one at
// the edge of something, adds or removes it.
void MutateMessage(google::protobuf::Message& message, std::minstd_rand& dice);

}  // namespace halflight::fuzz
