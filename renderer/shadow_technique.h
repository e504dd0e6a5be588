// The one interface chosen at run time: how shadows get into the image. A technique plans a frame
// without GL and draws it whole; it has a row in the table of shadow_technique.cpp.
#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "renderer/frame.h"
#include "renderer/particle_view.h"
#include "renderer/readback.h"

namespace halflight {

class FrameCache;
class RasterPieces;
struct DeviceInfo;
struct Gpu;
struct Projection;

// Everything that a frame is drawn from. `plan` is that of the same request.
struct DrawContext {
  Gpu& gpu;
  const DeviceInfo& device;
  FrameCache& cache;
  RasterPieces& pieces;
  const FrameRequest& request;
  const ParticleView& particles;
  const FramePlan& plan;
  StageClock& clock;
  std::stop_token stop;
  gl::StagingMemory* staging = nullptr;  // for what is read back; null: each copy waits
};

struct DrawnFrame {
  std::vector<Image> images;  // in the order of the request; empty where they are `arriving`
  std::unique_ptr<ArrivingImages> arriving;
  std::vector<LightReport> reports;  // one for each light of the scene
  std::vector<PlannedPass> reused;   // of the plan: not run, since the cache had what they give
};

class ShadowTechnique {
 public:
  virtual ~ShadowTechnique() = default;

  // InvalidArgument, naming the field, for what the technique cannot do, whatever the particles. No
  // GL.
  [[nodiscard]] virtual absl::Status Check(const FrameRequest& request) const = 0;

  // Adds to the plan of a request that was checked, whose sizes are set: what will be drawn, and
  // the passes that it comes to. No GL. InvalidArgument, naming the field, for what it cannot do
  // with these particles.
  virtual absl::Status Plan(const FrameRequest& request, const ParticleView& particles,
                            FramePlan& plan) const = 0;

  // Whether Draw records what the device does, rather than doing it itself; unless that fails.
  [[nodiscard]] virtual bool DrawsOnDevice(const FrameRequest& request,
                                           const DeviceInfo& device) const = 0;

  // Cancelled soon after the context's stop was requested. The GL context is current. Call with no
  // GL error unread: those that are there when it returns an error are this frame's.
  [[nodiscard]] virtual absl::StatusOr<DrawnFrame> Draw(const DrawContext& context) const = 0;
};

const ShadowTechnique& TechniqueFor(ShadowTechniqueKind kind);

// What draws a request that leaves its technique open, on a device that is a CPU rasteriser or is
// not: on a CPU the light sweep wherever it can, which is faster there and nearer the image model;
// otherwise half-angle slicing. On GPUs that stays so until the sweep has been measured on one.
// `request.scene.shadow.technique` does not matter.
ShadowTechniqueKind DefaultTechnique(const FrameRequest& request, bool software_renderer);

// What half-angle slicing composites by where a request asks for `asked`: kAuto becomes one of the
// others, tiles on GPUs, which are short of blend units.
SliceCompositor CompositorFor(SliceCompositor asked, bool software_renderer);

// What a tool needs to place the buffer of a light that casts shadows.
LightReport ReportOf(const Projection& light);

// Whether an output shows this, of any light or of one.
bool Shows(const FrameRequest& request, ImageKind kind);
bool ShowsOfLight(const FrameRequest& request, ImageKind kind, size_t light);

// What techniques refuse in the same words, as InvalidArgument. `technique` is the refusing one's
// name in the service, such as "LIGHT_SWEEP".

// "<field>: <value>, allowed under technique <technique>: <allowed>"
absl::Status Refuse(const std::string& field, const std::string& value, const char* technique,
                    const std::string& allowed);
// For techniques that go over the lights: at most kMaxLights.
absl::Status CheckLightCount(const Scene& scene);
// For techniques whose light buffers see the particles through one frustum: no shadow-casting light
// among them.
absl::Status CheckLightsOutside(const Scene& scene, const ParticleView& particles,
                                const char* technique);
// For techniques that cannot scatter; `reason` says why.
absl::Status CheckNoScattering(const Scene& scene, const char* technique, const char* reason);

}  // namespace halflight
