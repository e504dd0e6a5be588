// A client that is killed in mid-upload: sends a set from where the server has it, as far as it is
// told to, and dies there of SIGKILL; or sends all of it.
//
//   upload_child ADDRESS PARTICLES CHUNK_BYTES DIE_AT

#include <csignal>
#include <cstdlib>
#include <iostream>

#include <grpcpp/grpcpp.h>

#include "halflight/v1/service.grpc.pb.h"
#include "tests/server/made_particles.h"
#include "tests/server/upload_messages.h"

int main(int argc, char** argv) {
  using namespace halflight;           // NOLINT(google-build-using-namespace): one function
  using namespace halflight::testing;  // NOLINT(google-build-using-namespace)
  if (argc != 5) {
    return 2;
  }
  const v1::InlineParticles particles =
      MakeParticles(std::atoi(argv[2]), {v1::PARTICLE_ATTRIBUTE_POSITION});
  const uint64_t chunk_bytes = std::strtoull(argv[3], nullptr, 10);
  const uint64_t die_at = std::strtoull(argv[4], nullptr, 10);
  const v1::ParticleSetDescription description = Describe(particles);
  const auto stub =
      v1::RenderService::NewStub(grpc::CreateChannel(argv[1], grpc::InsecureChannelCredentials()));

  grpc::ClientContext query_context;
  query_context.set_wait_for_ready(true);
  v1::QueryUploadRequest query;
  query.set_sha256(description.sha256());
  v1::QueryUploadResponse there;
  if (const auto status = stub->QueryUpload(&query_context, query, &there); !status.ok()) {
    std::cerr << status.error_message() << "\n";
    return 1;
  }
  grpc::ClientContext context;
  v1::UploadParticlesResponse response;
  const auto writer = stub->UploadParticles(&context, &response);
  writer->Write(Header(description, there.committed_bytes()));
  for (uint64_t at = there.committed_bytes(); at < particles.payload().size();) {
    const std::string chunk = particles.payload().substr(at, chunk_bytes);
    if (at + chunk.size() > die_at) {
      raise(SIGKILL);
    }
    if (!writer->Write(Chunk(chunk))) {
      break;
    }
    at += chunk.size();
  }
  writer->Write(Finish(description));
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  std::cerr << status.error_message() << "\n";
  return status.ok() ? 0 : 1;
}
