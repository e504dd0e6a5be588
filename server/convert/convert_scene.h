// Scene messages to the renderer's scene: lights, material, shadow, sampling and what they need of
// each other and of the particles. Leaves the camera to convert_camera.
#pragma once

#include <memory>
#include <string>

#include "halflight/v1/scene.pb.h"
#include "renderer/scene.h"
#include "server/convert/field_checks.h"
#include "server/limits.h"

namespace halflight {

// Defaults filled in. The result is only meaningful when the checks are passed; field paths start
// with "scene". `particles` are what the message's `particles` stand for. Whether the technique can
// draw it stands in CheckTechnique.
Scene ConvertScene(const v1::Scene& scene, std::shared_ptr<const ParticleSet> particles,
                   const ServerLimits& limits, FieldChecks& checks);

// Whether the settings leave the technique open: it is unset, and so is all that only slices have
// (slices, interpolate, spacing, blur_mode, blur_texels, compositor).
bool LeavesTechniqueOpen(const v1::Shadow& shadow);

// What the technique of the scene needs of it. The scene has passed its checks.
void CheckTechnique(const Scene& scene, const ServerLimits& limits, FieldChecks& checks);

// Rejects `field` where evaluating the image model at so many `pixels` of the scene goes beyond the
// limit on it (ReferenceWork); `what` asks for it.
void CheckReferenceWork(const std::string& field, const std::string& what, double pixels,
                        const Scene& scene, const ServerLimits& limits, FieldChecks& checks);

// The other way: settings as used, for the frame's metadata.
v1::Shadow DescribeShadow(const ShadowSettings& shadow);

}  // namespace halflight
