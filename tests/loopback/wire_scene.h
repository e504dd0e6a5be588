// The renderer's scenes as the messages of the service: the way back from server/convert, written
// without it, so that a frame over the wire can be held to one made without any.
#pragma once

#include <string>
#include <vector>

#include "client/particles.h"
#include "halflight/v1/service.pb.h"
#include "renderer/scene.h"

namespace halflight::loopback {

client::EncodedParticles Encoded(const ParticleSet& set);

v1::InlineParticles Inline(const ParticleSet& set);

// Everything but the particles and the outputs.
v1::RenderFrameRequest RequestWithoutParticles(const Scene& scene);

// The scene with its particles inline; one output, raw floats of `kind`.
v1::RenderFrameRequest RequestOf(const Scene& scene, v1::OutputKind kind = v1::OUTPUT_KIND_BEAUTY);

v1::Output OutputOf(v1::OutputKind kind, v1::ImageFormat format = v1::IMAGE_FORMAT_RAW_FLOAT);

// What a raw output holds.
std::vector<float> FloatsOf(const std::string& bytes);

// Infinity where the sizes differ.
double MaxDifference(const std::vector<float>& a, const std::vector<float>& b);

}  // namespace halflight::loopback
