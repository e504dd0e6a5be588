// Small frames that are the same each time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <grpcpp/channel.h>

#include "client/particles.h"
#include "halflight/v1/service.pb.h"
#include "tests/soak/call.h"

namespace halflight::soak {

// A ball of particles, another one for each seed.
client::EncodedParticles BallOf(size_t particles, uint32_t seed = 1);

// A square image of the ball, raw floats of the beauty: 16 bytes a pixel. Drawn slice by slice
// through GL; the light sweep instead draws on the server's CPU.
v1::RenderFrameRequest FrameOf(const std::string& sha256, int pixels, int slices = 16);
v1::RenderFrameRequest SweepOf(const std::string& sha256, int pixels);

// Sends the set, as a client does.
void Upload(const std::string& address, const client::EncodedParticles& particles,
            const std::string& token = "");

// A frame, start to end.
CallOptions Ask(const v1::RenderFrameRequest& request);
// The bytes of its outputs; Abandoned where it does not come whole.
std::vector<std::string> MustRender(const std::shared_ptr<grpc::Channel>& channel,
                                    const v1::RenderFrameRequest& request);

}  // namespace halflight::soak
