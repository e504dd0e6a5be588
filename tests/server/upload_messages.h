// The messages of an upload, for tests.
#pragma once

#include <string>

#include "halflight/particle_payload.h"
#include "halflight/v1/particles.pb.h"
#include "halflight/v1/scene.pb.h"

namespace halflight::testing {

inline v1::ParticleSetDescription Describe(const v1::InlineParticles& particles) {
  v1::ParticleSetDescription header;
  *header.mutable_layout() = particles.layout();
  header.set_byte_size(particles.payload().size());
  Sha256 digest = BeginParticleDigest(particles.layout());
  digest.Update(particles.payload());
  header.set_sha256(digest.Finish());
  return header;
}

inline v1::UploadParticlesRequest Header(const v1::ParticleSetDescription& header,
                                         uint64_t resume_offset = 0) {
  v1::UploadParticlesRequest request;
  *request.mutable_header() = header;
  request.mutable_header()->set_resume_offset(resume_offset);
  return request;
}

inline v1::UploadParticlesRequest Chunk(const std::string& bytes) {
  v1::UploadParticlesRequest request;
  request.set_chunk(bytes);
  return request;
}

inline v1::UploadParticlesRequest Finish(const v1::ParticleSetDescription& header) {
  v1::UploadParticlesRequest request;
  request.mutable_finish()->set_byte_size(header.byte_size());
  request.mutable_finish()->set_sha256(header.sha256());
  return request;
}

}  // namespace halflight::testing
