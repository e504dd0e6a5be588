// What the parts of a scene need of each other and of its particles, once each is right by itself.
#pragma once

#include <string>

#include "renderer/scene.h"
#include "server/convert/field_checks.h"
#include "server/limits.h"

namespace halflight {

// Of scene.time_offset_s: particles that can move, and where they come to.
void CheckMotion(const Scene& scene, FieldChecks& checks);

// What the technique of the scene needs of it. The scene has passed its checks.
void CheckTechnique(const Scene& scene, const ServerLimits& limits, FieldChecks& checks);

// Rejects `field` where evaluating the image model at so many `pixels` of the scene goes beyond the
// limit on it (ReferenceWork); `what` asks for it.
void CheckReferenceWork(const std::string& field, const std::string& what, double pixels,
                        const Scene& scene, const ServerLimits& limits, FieldChecks& checks);

}  // namespace halflight
