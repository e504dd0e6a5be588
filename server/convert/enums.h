// Which enumerator of the messages means which of the renderer's, in both directions: a new
// enumerator is one row here.
#pragma once

#include <array>
#include <string>

#include <google/protobuf/generated_enum_reflection.h>

#include "halflight/v1/frame.pb.h"
#include "halflight/v1/scene.pb.h"
#include "renderer/image.h"
#include "renderer/scene.h"
#include "server/convert/field_checks.h"
#include "server/encode/encode.h"

namespace halflight {

template <typename Proto, typename Domain>
struct EnumRow {
  Proto proto;
  Domain domain;
};
// Clang before 17 does not deduce aggregates by itself.
template <typename Proto, typename Domain>
EnumRow(Proto, Domain) -> EnumRow<Proto, Domain>;

inline constexpr std::array kProfiles = {
    EnumRow{v1::PROFILE_SOFT, Profile::kSoft},
    EnumRow{v1::PROFILE_BALL, Profile::kBall},
};
inline constexpr std::array kTechniques = {
    EnumRow{v1::SHADOW_TECHNIQUE_HALF_ANGLE, ShadowTechniqueKind::kHalfAngle},
    EnumRow{v1::SHADOW_TECHNIQUE_REFERENCE, ShadowTechniqueKind::kReference},
    EnumRow{v1::SHADOW_TECHNIQUE_LIGHT_SWEEP, ShadowTechniqueKind::kLightSweep},
    EnumRow{v1::SHADOW_TECHNIQUE_PARTICLE_SHADOW_MAP, ShadowTechniqueKind::kParticleShadowMap},
};
inline constexpr std::array kSpacings = {
    EnumRow{v1::SLICE_SPACING_EQUAL_COUNT, SliceSpacing::kEqualCount},
    EnumRow{v1::SLICE_SPACING_EQUAL_OPTICAL_DEPTH, SliceSpacing::kEqualOpticalDepth},
};
inline constexpr std::array kCompositors = {
    EnumRow{v1::SLICE_COMPOSITOR_RASTER, SliceCompositor::kRaster},
    EnumRow{v1::SLICE_COMPOSITOR_TILES, SliceCompositor::kTiles},
};
inline constexpr std::array kBlurModes = {
    EnumRow{v1::BLUR_MODE_DISTANCE, BlurMode::kDistance},
    EnumRow{v1::BLUR_MODE_TEXELS_PER_SLICE, BlurMode::kTexelsPerSlice},
};
inline constexpr std::array kOutputKinds = {
    EnumRow{v1::OUTPUT_KIND_BEAUTY, ImageKind::kBeauty},
    EnumRow{v1::OUTPUT_KIND_COVERAGE, ImageKind::kCoverage},
    EnumRow{v1::OUTPUT_KIND_DEPTH, ImageKind::kDepth},
    EnumRow{v1::OUTPUT_KIND_LIGHT_TRANSMITTANCE, ImageKind::kLightTransmittance},
    EnumRow{v1::OUTPUT_KIND_LIGHT_BUFFER, ImageKind::kLightBuffer},
    EnumRow{v1::OUTPUT_KIND_LIGHT_LAYERS, ImageKind::kLightLayers},
    EnumRow{v1::OUTPUT_KIND_ERROR, ImageKind::kError},
};
inline constexpr std::array kQuantities = {
    EnumRow{v1::LIGHT_QUANTITY_TRANSMITTANCE, LightQuantity::kTransmittance},
    EnumRow{v1::LIGHT_QUANTITY_OPTICAL_DEPTH, LightQuantity::kOpticalDepth},
};
inline constexpr std::array kFormats = {
    EnumRow{v1::IMAGE_FORMAT_PNG8, ImageFormat::kPng8},
    EnumRow{v1::IMAGE_FORMAT_PNG16, ImageFormat::kPng16},
    EnumRow{v1::IMAGE_FORMAT_EXR_HALF, ImageFormat::kExrHalf},
    EnumRow{v1::IMAGE_FORMAT_EXR_FLOAT, ImageFormat::kExrFloat},
    EnumRow{v1::IMAGE_FORMAT_RAW_FLOAT, ImageFormat::kRawFloat},
};
inline constexpr std::array kCompressions = {
    EnumRow{v1::EXR_COMPRESSION_NONE, ExrCompression::kNone},
    EnumRow{v1::EXR_COMPRESSION_RLE, ExrCompression::kRle},
    EnumRow{v1::EXR_COMPRESSION_ZIPS, ExrCompression::kZips},
    EnumRow{v1::EXR_COMPRESSION_ZIP, ExrCompression::kZip},
    EnumRow{v1::EXR_COMPRESSION_PIZ, ExrCompression::kPiz},
    EnumRow{v1::EXR_COMPRESSION_DWAA, ExrCompression::kDwaa},
    EnumRow{v1::EXR_COMPRESSION_DWAB, ExrCompression::kDwab},
};

template <typename Table, typename Domain>
auto ToProto(const Table& table, Domain domain) {
  for (const auto& row : table) {
    if (row.domain == domain) {
      return row.proto;
    }
  }
  return decltype(table[0].proto){};
}

// The number 0 means unset and gives `unset`; a number without a row is rejected.
template <typename Table, typename Domain>
Domain FromProto(const Table& table, int number, Domain unset, const std::string& field,
                 FieldChecks& checks) {
  if (number == 0) {
    return unset;
  }
  const auto* const names = google::protobuf::GetEnumDescriptor<decltype(table[0].proto)>();
  std::string allowed;
  for (const auto& row : table) {
    if (row.proto == number) {
      return row.domain;
    }
    allowed += allowed.empty() ? "" : ", ";
    allowed += names->FindValueByNumber(row.proto)->name();
  }
  checks.Reject(field, fmt::format("{}", number), allowed);
  return unset;
}

}  // namespace halflight
