// Requests of sequences: the first byte chooses the server, then come RenderSequenceRequests as
// they come over the wire, each after its size in two bytes.
#include "halflight/v1/service.pb.h"
#include "server/handlers/sequence_state.h"
#include "server/partial_uploads.h"
#include "tests/fuzz/accepted_job.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/requests.h"
#include "tests/fuzz/require.h"
#include "tests/server/fake_engine.h"

namespace halflight::fuzz {
namespace {

constexpr int kMaxFrames = 16;

void Check(Input input) {
  static auto* const engine = new testing::FakeEngine;
  static auto* const pipeline = new FramePipeline(*engine, {});
  static auto* const memory = new ByteBudget(kGiB);
  static auto* const partial = new PartialUploads(*memory, {});
  static const auto* const version = new std::string("fuzz");

  const Server& server = ServerOf(input.Byte());
  const Backend backend{server.device,   server.limits, *version,
                        StoreWithSets(), *partial,      *pipeline};
  SequenceState state(backend);
  for (int i = 0; i < kMaxFrames && !input.empty(); ++i) {
    const std::string_view bytes = input.Bytes(input.Short());
    v1::RenderSequenceRequest request;
    if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
      return;
    }
    const auto job = state.Next(request.frame());
    if (i == 0) {
      const auto alone =
          ConvertRequest(request.frame(), backend.store, server.limits, server.device);
      Require(job.status() == alone.status(), "the first frame is one like a single one");
    }
    // As the handler does: the stream ends with the first frame that is refused.
    if (!job.ok()) {
      CheckRefused(job.status());
      return;
    }
    CheckAccepted(*job, server.limits);
  }
}

}  // namespace
}  // namespace halflight::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  halflight::fuzz::Check({data, size});
  return 0;
}
