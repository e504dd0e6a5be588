// What the flags of each command say, one flat struct a command. Filled by flags.cpp; unset where
// a flag was not given, so that it can tell what the user wants from what is left to choose.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/framing.h"
#include "halflight/v1/frame.pb.h"
#include "halflight/v1/scene.pb.h"

namespace halflight::client {

// How to get at a server; for all commands.
struct ConnectionOptions {
  std::string server;  // empty: start one
  std::string device;  // of the server that is started
  double timeout_s = 600;
  // Of the server that is named.
  Security security;
  std::string token_file;  // empty: HALFLIGHT_TOKEN
};

struct OutputFlag {
  v1::OutputKind kind = v1::OUTPUT_KIND_BEAUTY;
  std::string path;  // a pattern where frames are given
};

struct LightFlag {
  enum class Kind : unsigned char { kDirection, kPoint, kCamera };
  Kind kind = Kind::kCamera;
  Vec3 value{};  // direction of travel, or place
};

struct Size {
  uint32_t width = 0;
  uint32_t height = 0;
};

struct RenderOptions {
  ConnectionOptions connection;

  // Files.
  std::string input;   // a pattern where frames are given
  std::string format;  // empty: by extension
  std::vector<int64_t> frames;
  std::vector<OutputFlag> outputs;
  std::string scene_path;
  bool print_scene = false;

  // How outputs are stored.
  std::optional<uint32_t> png_bits;
  std::optional<v1::ImageFormat> exr_format;
  std::optional<v1::ExrCompression> exr_compression;
  std::optional<v1::LightQuantity> quantity;
  std::optional<uint32_t> output_light;

  // Camera.
  std::optional<Size> size;
  std::optional<std::vector<uint32_t>> crop;  // x, y, width, height
  std::optional<Vec3> eye;
  std::optional<Vec3> target;
  std::optional<Vec3> up;
  std::optional<double> fov_deg;
  bool ortho = false;
  std::optional<double> ortho_height;

  // Lights: colours and densities one for all lights, or one for each.
  std::optional<std::vector<LightFlag>> lights;
  std::vector<Vec3> light_colors;
  std::vector<Vec3> densities;
  bool falloff = false;

  // Material.
  std::optional<double> radius;
  std::optional<double> opacity;
  std::optional<Vec3> albedo;
  std::optional<Vec3> ambient;
  std::optional<Vec3> emission;
  std::optional<v1::Profile> profile;
  std::optional<double> phase_g;
  std::optional<double> scattering_spread;
  std::optional<double> scattering_g;
  std::optional<double> scattering_albedo;

  // Shadow and sampling.
  std::optional<v1::ShadowTechnique> technique;
  std::optional<uint32_t> slices;
  bool plain = false;
  std::optional<v1::SliceSpacing> spacing;
  std::optional<v1::SliceCompositor> compositor;
  std::optional<uint32_t> light_buffer_size;
  std::optional<uint32_t> fit_degree;
  std::optional<v1::BlurMode> blur_mode;
  std::optional<double> blur_texels;
  std::optional<uint32_t> supersample;
  std::optional<uint32_t> downsample;
  std::optional<double> time_offset_s;

  // Its error.
  std::optional<uint32_t> error_samples;  // measure it, at so many pixels
  std::optional<uint64_t> error_seed;
  std::optional<double> max_error;  // relative RMSE
  std::optional<double> max_time_ms;

  // What is said about it.
  std::string request_id;
  bool json = false;
  bool quiet = false;
};

struct InfoOptions {
  ConnectionOptions connection;
  bool json = false;
};

}  // namespace halflight::client
