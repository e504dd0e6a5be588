// The one interface chosen at run time: how shadows get into the image. A technique plans a frame
// without GL and draws it whole; it has a row in the table of shadow_technique.cpp.
#pragma once

#include <stop_token>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "renderer/frame.h"
#include "renderer/particle_view.h"

namespace halflight {

struct DeviceInfo;
struct Gpu;
class StageClock;

// Everything that a frame is drawn from. `plan` is that of the same request.
struct DrawContext {
  Gpu& gpu;
  const DeviceInfo& device;
  const FrameRequest& request;
  const ParticleView& particles;
  const FramePlan& plan;
  StageClock& clock;
  std::stop_token stop;
};

struct DrawnFrame {
  std::vector<Image> images;         // in the order of the request
  std::vector<LightReport> reports;  // one for each light of the scene
};

class ShadowTechnique {
 public:
  virtual ~ShadowTechnique() = default;

  // Adds to a plan whose sizes are set: what will be drawn, and the passes that it comes to. No GL.
  // InvalidArgument, naming the field, for what the technique cannot do.
  virtual absl::Status Plan(const FrameRequest& request, const ParticleView& particles,
                            FramePlan& plan) const = 0;

  // Cancelled soon after the context's stop was requested. The GL context is current.
  [[nodiscard]] virtual absl::StatusOr<DrawnFrame> Draw(const DrawContext& context) const = 0;
};

const ShadowTechnique& TechniqueFor(ShadowTechniqueKind kind);

// For techniques that go over the lights: at most kMaxLights.
absl::Status CheckLightCount(const Scene& scene);

}  // namespace halflight
