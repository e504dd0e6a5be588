// Mutation of requests, for the targets that take them.
#pragma once

#include <random>
#include <string>

#include "halflight/v1/service.pb.h"

namespace halflight::fuzz {

// Changes one field, or which of the particles that the server has it names.
void MutateRequest(v1::RenderFrameRequest& request, std::minstd_rand& dice);

// Bytes changed as libFuzzer does of itself.
std::string MutatedBytes(std::string bytes, size_t max_size);

// Puts the bytes where libFuzzer wants them, cut at what there is room for.
size_t Put(const std::string& bytes, uint8_t* data, size_t max_size);

}  // namespace halflight::fuzz
