#include "server/convert/convert_shadow.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "server/convert/enums.h"

namespace halflight {
namespace {

constexpr double kMaxBlurTexels = 64.0;

}  // namespace

ShadowSettings ConvertShadow(const v1::Shadow& shadow, const ServerLimits& limits,
                             FieldChecks& checks) {
  const std::string path = "scene.shadow";
  ShadowSettings converted;
  converted.technique =
      FromProto(kTechniques, shadow.technique(), converted.technique, path + ".technique", checks);
  const auto default_slices = std::min<uint32_t>(converted.slices, limits.max_slices);
  converted.slices = static_cast<int>(checks.InRangeOr(
      path + ".slices", shadow.slices(), default_slices,
      {.low = 1.0, .high = static_cast<double>(limits.max_slices), .server_limit = true}));
  converted.interpolate = !shadow.has_interpolate() || shadow.interpolate();
  converted.spacing =
      FromProto(kSpacings, shadow.spacing(), converted.spacing, path + ".spacing", checks);
  converted.compositor = FromProto(kCompositors, shadow.compositor(), converted.compositor,
                                   path + ".compositor", checks);
  converted.max_light_buffer_size = static_cast<int>(limits.max_light_buffer_size);
  converted.light_buffer_size =
      static_cast<int>(checks.InRangeOr(path + ".light_buffer_size", shadow.light_buffer_size(), 0U,
                                        {.low = static_cast<double>(kMinLightBufferSize),
                                         .high = static_cast<double>(limits.max_light_buffer_size),
                                         .server_limit = true}));
  if (shadow.has_fit_degree()) {
    converted.fit_degree =
        static_cast<int>(checks.InRange(path + ".fit_degree", shadow.fit_degree(),
                                        {.low = 0.0, .high = static_cast<double>(kMaxFitDegree)}));
  }
  converted.blur_mode =
      FromProto(kBlurModes, shadow.blur_mode(), converted.blur_mode, path + ".blur_mode", checks);
  converted.blur_texels = shadow.blur_texels();
  if (converted.blur_mode == BlurMode::kTexelsPerSlice) {
    checks.InRange(path + ".blur_texels", converted.blur_texels,
                   {.low = 0.0, .high = kMaxBlurTexels, .open_low = true});
  } else if (converted.blur_texels != 0.0F) {
    checks.Reject(path + ".blur_texels", fmt::format("{}", converted.blur_texels),
                  "unset, unless blur_mode is BLUR_MODE_TEXELS_PER_SLICE");
  }
  return converted;
}

bool LeavesTechniqueOpen(const v1::Shadow& shadow) {
  return shadow.technique() == v1::SHADOW_TECHNIQUE_UNSPECIFIED && shadow.slices() == 0 &&
         !shadow.has_interpolate() && shadow.spacing() == v1::SLICE_SPACING_UNSPECIFIED &&
         shadow.blur_mode() == v1::BLUR_MODE_UNSPECIFIED && shadow.blur_texels() == 0.0F &&
         shadow.compositor() == v1::SLICE_COMPOSITOR_UNSPECIFIED;
}

v1::Shadow DescribeShadow(const ShadowSettings& shadow) {
  v1::Shadow described;
  described.set_technique(ToProto(kTechniques, shadow.technique));
  described.set_slices(shadow.slices);
  described.set_interpolate(shadow.interpolate);
  described.set_spacing(ToProto(kSpacings, shadow.spacing));
  described.set_light_buffer_size(shadow.light_buffer_size);
  described.set_blur_mode(ToProto(kBlurModes, shadow.blur_mode));
  described.set_blur_texels(shadow.blur_texels);
  described.set_fit_degree(shadow.fit_degree);
  described.set_compositor(ToProto(kCompositors, shadow.compositor));
  return described;
}

}  // namespace halflight
