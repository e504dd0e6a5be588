// Scene messages to the renderer's scene: lights, material and sampling. Leaves the camera to
// convert_camera, shadows to convert_shadow, and what they need of each other to scene_checks.
#pragma once

#include <memory>

#include "halflight/v1/scene.pb.h"
#include "renderer/scene.h"
#include "server/convert/field_checks.h"
#include "server/limits.h"

namespace halflight {

// Defaults filled in. The result is only meaningful when the checks are passed; field paths start
// with "scene". `particles` are what the message's `particles` stand for. Whether the technique can
// draw it stands in scene_checks.h.
Scene ConvertScene(const v1::Scene& scene, std::shared_ptr<const ParticleSet> particles,
                   const ServerLimits& limits, FieldChecks& checks);

}  // namespace halflight
