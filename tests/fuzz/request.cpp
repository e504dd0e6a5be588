// Requests of single frames: the first byte chooses the server, the rest is a RenderFrameRequest as
// it comes over the wire.
#include "halflight/v1/service.pb.h"
#include "server/convert/convert_frame.h"
#include "tests/fuzz/accepted_job.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/requests.h"

namespace halflight::fuzz {
namespace {

void Check(Input input) {
  const Server& server = ServerOf(input.Byte());
  const std::string_view bytes = input.Rest();
  v1::RenderFrameRequest request;
  if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return;
  }
  const auto job = ConvertRequest(request, StoreWithSets(), server.limits, server.device);
  if (job.ok()) {
    CheckAccepted(*job, server.limits);
  } else {
    CheckRefused(job.status());
  }
}

}  // namespace
}  // namespace halflight::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  halflight::fuzz::Check({data, size});
  return 0;
}
