// How shadows are computed: messages to the renderer's settings and back.
#pragma once

#include "halflight/v1/scene.pb.h"
#include "renderer/scene.h"
#include "server/convert/field_checks.h"
#include "server/limits.h"

namespace halflight {

// Defaults filled in; field paths start with "scene.shadow".
ShadowSettings ConvertShadow(const v1::Shadow& shadow, const ServerLimits& limits,
                             FieldChecks& checks);

// Whether the settings leave the technique open: it is unset, and so is all that only slices have
// (slices, interpolate, spacing, blur_mode, blur_texels, compositor).
bool LeavesTechniqueOpen(const v1::Shadow& shadow);

// The other way: settings as used, for the frame's metadata.
v1::Shadow DescribeShadow(const ShadowSettings& shadow);

}  // namespace halflight
