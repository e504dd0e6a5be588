#include "client/cli/request_builder.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "absl/strings/ascii.h"
#include "client/cli/flag_values.h"

namespace halflight::client {

namespace {

void SetVector(const Vec3& from, v1::Vector3& to) {
  to.set_x(from[0]);
  to.set_y(from[1]);
  to.set_z(from[2]);
}

void SetColor(const Vec3& from, v1::Color& to) {
  to.set_r(static_cast<float>(from[0]));
  to.set_g(static_cast<float>(from[1]));
  to.set_b(static_cast<float>(from[2]));
}

bool IsExr(v1::ImageFormat format) {
  return format == v1::IMAGE_FORMAT_EXR_HALF || format == v1::IMAGE_FORMAT_EXR_FLOAT;
}

// What the extension of `path` asks for, together with the flags on storage.
absl::StatusOr<v1::ImageFormat> FormatOf(const std::string& path, const RenderOptions& options,
                                         const v1::Output& output) {
  const std::string extension =
      absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  if (extension == ".png") {
    const bool was_16 = output.format() == v1::IMAGE_FORMAT_PNG16;
    return options.png_bits.value_or(was_16 ? 16 : 8) == 16 ? v1::IMAGE_FORMAT_PNG16
                                                            : v1::IMAGE_FORMAT_PNG8;
  }
  if (extension == ".exr") {
    const bool needs_float = output.kind() == v1::OUTPUT_KIND_DEPTH ||
                             output.kind() == v1::OUTPUT_KIND_ERROR ||
                             output.quantity() == v1::LIGHT_QUANTITY_OPTICAL_DEPTH;
    const auto by_content = needs_float ? v1::IMAGE_FORMAT_EXR_FLOAT : v1::IMAGE_FORMAT_EXR_HALF;
    return options.exr_format.value_or(IsExr(output.format()) ? output.format() : by_content);
  }
  if (extension == ".raw" || extension == ".bin") {
    return v1::IMAGE_FORMAT_RAW_FLOAT;
  }
  return absl::InvalidArgumentError(fmt::format(
      "--output: extension of '{}' is '{}'; allowed: .png, .exr, .raw, .bin", path, extension));
}

// The flags' outputs replace the scene's; what the scene says of an output of the same kind stays.
absl::Status ApplyOutputs(const RenderOptions& options, v1::RenderFrameRequest& request) {
  const auto in_scene = request.outputs();
  if (!options.outputs.empty()) {
    request.clear_outputs();
  }
  bool has_png = false;
  bool has_exr = false;
  bool has_buffer = false;
  bool has_light = false;
  for (const OutputFlag& flag : options.outputs) {
    v1::Output& output = *request.add_outputs();
    for (const v1::Output& other : in_scene) {
      if (other.kind() == flag.kind) {
        output = other;
        break;
      }
    }
    output.set_kind(flag.kind);
    const bool is_buffer =
        flag.kind == v1::OUTPUT_KIND_LIGHT_BUFFER || flag.kind == v1::OUTPUT_KIND_LIGHT_LAYERS;
    if (is_buffer && options.quantity) {
      output.set_quantity(*options.quantity);
    }
    const bool is_of_light = is_buffer || flag.kind == v1::OUTPUT_KIND_LIGHT_TRANSMITTANCE;
    if (is_of_light && options.output_light) {
      output.set_light_index(*options.output_light);
    }
    const auto format = FormatOf(flag.path, options, output);
    if (!format.ok()) {
      return format.status();
    }
    output.set_format(*format);
    if (!IsExr(*format)) {
      output.clear_compression();
    } else if (options.exr_compression) {
      output.set_compression(*options.exr_compression);
    }
    has_buffer = has_buffer || is_buffer;
    has_light = has_light || is_of_light;
    has_exr = has_exr || IsExr(*format);
    has_png = has_png || (!IsExr(*format) && *format != v1::IMAGE_FORMAT_RAW_FLOAT);
  }

  // A flag that changes nothing is more likely a mistake than a wish.
  struct Use {
    bool given;
    bool used;
    const char* flag;
    const char* needs;
  };
  for (const Use& use :
       {Use{options.png_bits.has_value(), has_png, "--bits", "an --output that ends in .png"},
        Use{options.exr_format.has_value(), has_exr, "--exr", "an --output that ends in .exr"},
        Use{options.exr_compression.has_value(), has_exr, "--exr-compression",
            "an --output that ends in .exr"},
        Use{options.quantity.has_value(), has_buffer, "--quantity", "an --output light or layers"},
        Use{options.output_light.has_value(), has_light, "--output-light",
            "an --output transmittance, light or layers"}}) {
    if (use.given && !use.used) {
      return absl::InvalidArgumentError(
          fmt::format("{}: is given; allowed: only with {}", use.flag, use.needs));
    }
  }
  return absl::OkStatus();
}

void ApplyCamera(const RenderOptions& options, v1::Camera& camera) {
  if (options.size) {
    camera.set_width(options.size->width);
    camera.set_height(options.size->height);
  }
  if (options.crop) {
    v1::CropWindow& crop = *camera.mutable_crop();
    crop.set_x((*options.crop)[0]);
    crop.set_y((*options.crop)[1]);
    crop.set_width((*options.crop)[2]);
    crop.set_height((*options.crop)[3]);
  }
  // Setting one part of look_at puts it in place of a matrix.
  if (options.eye) {
    SetVector(*options.eye, *camera.mutable_look_at()->mutable_eye());
  }
  if (options.target) {
    SetVector(*options.target, *camera.mutable_look_at()->mutable_target());
  }
  if (options.up) {
    SetVector(*options.up, *camera.mutable_look_at()->mutable_up());
  }
  if (options.fov_deg) {
    camera.mutable_perspective()->set_vertical_fov_deg(*options.fov_deg);
  }
  if (options.ortho) {
    camera.mutable_orthographic();
  }
  if (options.ortho_height) {
    camera.mutable_orthographic()->set_height(*options.ortho_height);
  }
}

// The value for light `index`, where one value serves for all.
const Vec3& OneOrEach(const std::vector<Vec3>& values, size_t index) {
  return values.size() == 1 ? values[0] : values[index];
}

absl::Status ApplyLights(const RenderOptions& options, v1::Scene& scene) {
  if (options.lights) {
    scene.mutable_lighting()->clear_lights();
    for (const LightFlag& flag : *options.lights) {
      v1::Light& light = *scene.mutable_lighting()->add_lights();
      if (flag.kind == LightFlag::Kind::kPoint) {
        SetVector(flag.value, *light.mutable_point()->mutable_position());
      } else if (flag.kind == LightFlag::Kind::kDirection) {
        SetVector(flag.value, *light.mutable_directional()->mutable_direction());
      } else {
        light.mutable_directional();  // its direction is that of the view: scene_defaults.cpp
      }
    }
  } else if (!scene.has_lighting() &&
             (!options.light_colors.empty() || !options.densities.empty())) {
    scene.mutable_lighting()->add_lights();  // the default light, whose kind is chosen later
  }

  v1::Lighting* const lighting = scene.has_lighting() ? scene.mutable_lighting() : nullptr;
  const size_t count = lighting == nullptr ? 0 : static_cast<size_t>(lighting->lights_size());
  for (const auto& [flag, values] : {std::pair("--light-color", &options.light_colors),
                                     std::pair("--density", &options.densities)}) {
    if (!values->empty() && (count == 0 || (values->size() != 1 && values->size() != count))) {
      return absl::InvalidArgumentError(
          fmt::format("{}: given {} times for {} lights; allowed: once, or once for each light",
                      flag, values->size(), count));
    }
  }
  bool has_point = false;
  for (size_t i = 0; i < count; ++i) {
    v1::Light& light = *lighting->mutable_lights(static_cast<int>(i));
    if (!options.light_colors.empty()) {
      SetColor(OneOrEach(options.light_colors, i), *light.mutable_color());
    }
    if (!options.densities.empty()) {
      const Vec3& density = OneOrEach(options.densities, i);
      if (density[0] == density[1] && density[1] == density[2]) {
        light.set_density(static_cast<float>(density[0]));
      } else {
        SetColor(density, *light.mutable_density_rgb());
      }
    }
    if (light.has_point()) {
      has_point = true;
      if (options.falloff) {
        light.mutable_point()->set_inverse_square_falloff(true);
      }
    }
  }
  return !options.falloff || has_point
             ? absl::OkStatus()
             : absl::InvalidArgumentError(
                   "--falloff: is given; allowed: only with a light point:X,Y,Z");
}

void ApplyMaterial(const RenderOptions& options, v1::Scene& scene) {
  if (options.radius) {
    scene.mutable_material()->set_radius(static_cast<float>(*options.radius));
  }
  if (options.opacity) {
    scene.mutable_material()->set_opacity(static_cast<float>(*options.opacity));
  }
  if (options.albedo) {
    SetColor(*options.albedo, *scene.mutable_material()->mutable_albedo());
  }
  if (options.ambient) {
    SetColor(*options.ambient, *scene.mutable_material()->mutable_ambient());
  }
  if (options.emission) {
    SetColor(*options.emission, *scene.mutable_material()->mutable_emission());
  }
  if (options.profile) {
    scene.mutable_material()->set_profile(*options.profile);
  }
  if (options.phase_g) {
    scene.mutable_material()->set_phase_g(static_cast<float>(*options.phase_g));
  }
  if (options.scattering_spread) {
    scene.mutable_material()->set_scattering_spread(static_cast<float>(*options.scattering_spread));
    scene.mutable_material()->clear_physical_scattering();
  }
  if (options.scattering_g || options.scattering_albedo) {
    v1::PhysicalScattering& scattering = *scene.mutable_material()->mutable_physical_scattering();
    scene.mutable_material()->clear_scattering_spread();
    if (options.scattering_g) {
      scattering.set_mean_cosine(static_cast<float>(*options.scattering_g));
    }
    if (options.scattering_albedo) {
      scattering.set_albedo(static_cast<float>(*options.scattering_albedo));
    }
  }
}

// Settings and a target take each other's place.
void ApplyTarget(const RenderOptions& options, v1::RenderFrameRequest& request) {
  const bool has_settings = options.technique || options.slices || options.plain ||
                            options.spacing || options.compositor || options.light_buffer_size ||
                            options.blur_mode || options.blur_texels || options.fit_degree;
  if (has_settings) {
    request.clear_target();
  }
  if (options.max_error || options.max_time_ms) {
    request.mutable_scene()->clear_shadow();
  }
  if (options.max_error) {
    request.mutable_target()->set_max_error(*options.max_error);
  }
  if (options.max_time_ms) {
    request.mutable_target()->set_max_time_ms(*options.max_time_ms);
  }
}

void ApplyShadowAndSampling(const RenderOptions& options, v1::Scene& scene) {
  if (options.technique) {
    scene.mutable_shadow()->set_technique(*options.technique);
  }
  if (options.slices) {
    scene.mutable_shadow()->set_slices(*options.slices);
  }
  if (options.plain) {
    scene.mutable_shadow()->set_interpolate(false);
  }
  if (options.spacing) {
    scene.mutable_shadow()->set_spacing(*options.spacing);
  }
  if (options.compositor) {
    scene.mutable_shadow()->set_compositor(*options.compositor);
  }
  if (options.light_buffer_size) {
    scene.mutable_shadow()->set_light_buffer_size(*options.light_buffer_size);
  }
  if (options.fit_degree) {
    scene.mutable_shadow()->set_fit_degree(*options.fit_degree);
  }
  if (options.blur_texels) {
    scene.mutable_shadow()->set_blur_mode(v1::BLUR_MODE_TEXELS_PER_SLICE);
    scene.mutable_shadow()->set_blur_texels(static_cast<float>(*options.blur_texels));
  }
  if (options.blur_mode) {
    scene.mutable_shadow()->set_blur_mode(*options.blur_mode);
  }
  if (options.supersample) {
    scene.mutable_sampling()->set_supersample(*options.supersample);
  }
  if (options.downsample) {
    scene.mutable_sampling()->set_downsample(*options.downsample);
  }
  if (options.time_offset_s) {
    scene.set_time_offset_s(*options.time_offset_s);
  }
}

absl::Status ApplyMeasurement(const RenderOptions& options, v1::RenderFrameRequest& request) {
  if (options.error_samples) {
    request.mutable_measure_error()->set_samples(*options.error_samples);
  }
  if (options.error_seed) {
    if (!request.has_measure_error()) {
      return absl::InvalidArgumentError(
          "--error-seed: is given; allowed: only with --measure-error");
    }
    request.mutable_measure_error()->set_seed(*options.error_seed);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ApplyFlags(const RenderOptions& options, v1::RenderFrameRequest& request) {
  if (absl::Status status = ApplyOutputs(options, request); !status.ok()) {
    return status;
  }
  v1::Scene& scene = *request.mutable_scene();
  ApplyCamera(options, *scene.mutable_camera());
  if (absl::Status status = ApplyLights(options, scene); !status.ok()) {
    return status;
  }
  ApplyMaterial(options, scene);
  ApplyShadowAndSampling(options, scene);
  ApplyTarget(options, request);
  if (!options.request_id.empty()) {
    request.set_request_id(options.request_id);
  }
  return ApplyMeasurement(options, request);
}

}  // namespace halflight::client
