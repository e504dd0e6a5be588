// From a request message to what the pipeline works on: the entry to all conversion. Valid requests
// only come out of here; nothing behind it checks values again.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "halflight/v1/service.pb.h"
#include "renderer/frame.h"
#include "renderer/frame_engine.h"
#include "server/caller.h"
#include "server/convert/convert_measurement.h"
#include "server/convert/convert_outputs.h"
#include "server/convert/convert_target.h"
#include "server/limits.h"
#include "server/particle_assembler.h"
#include "server/particle_store.h"

namespace halflight {

// A frame to make.
struct FrameJob {
  std::string request_id;
  Caller caller;     // not of the request: filled in by who submits it
  int priority = 0;  // among the frames of that client
  std::string particle_sha256;
  std::string fingerprint;  // SHA-256 of all that the frame is made from
  FrameRequest request;
  std::vector<OutputJob> outputs;
  std::optional<MeasureJob> measure;
  // Where it is set, the request's shadow and sampling are where its choice starts from.
  std::optional<TargetJob> target;
  // Of all that is held for it at once, in 32-bit float, at most: its outputs, a picture that is
  // drawn to be measured, and what a search may yet return.
  uint64_t pixel_bytes = 0;
};

// The particles that a scene names or carries. InvalidArgument; NotFound for a name that the store
// does not hold; ResourceExhausted for inline particles over the limits.
absl::StatusOr<NamedParticles> ResolveParticles(const v1::Scene& scene, ParticleStore& store,
                                                const ServerLimits& limits);

// InvalidArgument "<path of the field>: <value>, allowed: <allowed>" for the first field that is
// wrong. The scene's own particles are not looked at: `particles` stand for them. `device` decides
// on a technique that the request leaves open.
absl::StatusOr<FrameJob> ConvertFrame(const v1::RenderFrameRequest& request,
                                      const NamedParticles& particles, const ServerLimits& limits,
                                      const DeviceInfo& device);

// Both of the above, for a request that stands alone.
absl::StatusOr<FrameJob> ConvertRequest(const v1::RenderFrameRequest& request, ParticleStore& store,
                                        const ServerLimits& limits, const DeviceInfo& device);

}  // namespace halflight
