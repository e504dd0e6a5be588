#include "client/cli/flags.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "client/cli/add_flag.h"
#include "client/cli/flag_values.h"
#include "client/readers/reader.h"
#include "client/readers/text.h"

namespace halflight::client {

namespace {

void AddConnectionFlags(CLI::App& app, ConnectionOptions& options) {
  auto* const server =
      app.add_option("--server", options.server,
                     "Use this server (host:port or unix:path) instead of starting halflightd")
          ->type_name("ADDRESS");
  app.add_option("--device", options.device, "Device of the halflightd that is started")
      ->type_name("DEVICE")
      ->excludes(server);
  app.add_flag("--tls", options.security.tls,
               "Encrypt, and believe servers whose certificate the system trusts")
      ->needs(server);
  const auto file = [&](const char* flag, std::string& path, const char* help) {
    app.add_option(flag, path, help)->type_name("FILE")->needs(server);
  };
  file("--tls-ca", options.security.ca_file,
       "Encrypt, and believe servers with a certificate of these authorities (PEM)");
  file("--tls-cert", options.security.cert_file, "Show this client certificate (PEM)");
  file("--tls-key", options.security.key_file, "Its private key (PEM)");
  file("--token-file", options.token_file,
       "Say who calls with the token in this file; default: with that in HALFLIGHT_TOKEN");
  app.add_flag("--insecure-token", options.security.insecure_token,
               "Send the token even where others can read it on the way")
      ->needs(server);
  app.add_option_function<std::string>(
         "--timeout",
         [&options](const std::string& text) {
           const auto value = ParseNumber(text);
           if (!value || !(*value >= 0) || *value > 1e6) {
             throw CLI::ValidationError(
                 "--timeout", fmt::format("is '{}'; allowed: seconds from 0 (never) to 1e6", text));
           }
           options.timeout_s = *value;
         },
         "Longest wait for a frame (default 600; 0: for ever)")
      ->type_name("SECONDS");
}

void AddFileFlags(CLI::App& app, RenderOptions& options) {
  app.add_option("input", options.input,
                 "Particle file, or with --frames a pattern such as 'plume.%04d.ply'")
      ->type_name("FILE");
  app.add_option_function<std::string>(
         "--format",
         [&options](const std::string& text) {
           if ((", " + FormatNames() + ",").find(", " + text + ",") == std::string::npos) {
             throw CLI::ValidationError("--format",
                                        fmt::format("is '{}'; allowed: {}", text, FormatNames()));
           }
           options.format = text;
         },
         "Format of the input (" + FormatNames() + "); default: by its extension")
      ->type_name("FORMAT");
  Add(app, "--frames", options.frames, ParseFrames,
      "Frames of a sequence: 24-40, 24-40x2, 1,5,24-40", "LIST");
  AddEach(app, "-o,--output", options.outputs, ParseOutput,
          "Write an output: PATH (beauty) or NAME=PATH, NAME one of " + OutputNames() +
              "; .png, .exr, .raw or .bin; repeatable",
          "[NAME=]PATH");
  app.add_option("--scene", options.scene_path,
                 "Start from this RenderFrameRequest in protobuf JSON; flags override it")
      ->type_name("FILE");
  app.add_flag("--print-scene", options.print_scene,
               "Write the request as JSON for --scene to stdout; render nothing");
}

void AddOutputFlags(CLI::App& app, RenderOptions& options) {
  AddChoice<uint32_t>(app, "--bits", options.png_bits, {{"8", 8}, {"16", 16}},
                      "Bits a channel of PNGs; default: 8");
  AddChoice<v1::ImageFormat>(
      app, "--exr", options.exr_format,
      {{"half", v1::IMAGE_FORMAT_EXR_HALF}, {"float", v1::IMAGE_FORMAT_EXR_FLOAT}},
      "Numbers in EXRs; default: half, but float for depth, optical depth and error");
  AddChoice<v1::ExrCompression>(app, "--exr-compression", options.exr_compression,
                                {{"none", v1::EXR_COMPRESSION_NONE},
                                 {"rle", v1::EXR_COMPRESSION_RLE},
                                 {"zips", v1::EXR_COMPRESSION_ZIPS},
                                 {"zip", v1::EXR_COMPRESSION_ZIP},
                                 {"piz", v1::EXR_COMPRESSION_PIZ},
                                 {"dwaa", v1::EXR_COMPRESSION_DWAA},
                                 {"dwab", v1::EXR_COMPRESSION_DWAB}},
                                "Compression of EXRs; default: zip");
  AddChoice<v1::LightQuantity>(app, "--quantity", options.quantity,
                               {{"transmittance", v1::LIGHT_QUANTITY_TRANSMITTANCE},
                                {"optical-depth", v1::LIGHT_QUANTITY_OPTICAL_DEPTH}},
                               "What light and layers hold; default: transmittance");
  AddCount(app, "--output-light", options.output_light, 0, 1000,
           "Which light transmittance, light and layers are of, counted from 0; default: 0");
}

void AddCameraFlags(CLI::App& app, RenderOptions& options) {
  Add(app, "--size", options.size, ParseSize, "Size of the image; default: 640x480", "WxH");
  Add(app, "--crop", options.crop, ParseCrop, "Render only this part of the image", "X,Y,W,H");
  Add(app, "--eye", options.eye, ParsePlace,
      "Where the camera is; default: a three-quarter view that shows all particles", "X,Y,Z");
  Add(app, "--target", options.target, ParsePlace,
      "What the camera looks at; default: the middle of the particles", "X,Y,Z");
  Add(app, "--up", options.up, ParseVector, "What appears upward; default: 0,1,0", "X,Y,Z");
  auto* const fov = AddNumber(app, "--fov", options.fov_deg,
                              {1e-6, 179, "degrees, >= 1e-6 and < 179", true, false},
                              "Vertical field of view in degrees; default: 40");
  app.add_flag("--ortho", options.ortho, "Parallel projection that shows all particles")
      ->excludes(fov);
  AddNumber(app, "--ortho-height", options.ortho_height,
            {kSmallestRadius, kFarthestPlace, "a number from 1e-15 to 1e18"},
            "Parallel projection of this height, world units")
      ->excludes(fov);
}

void AddLightFlags(CLI::App& app, RenderOptions& options) {
  app.add_option_function<std::vector<std::string>>(
         "--light",
         [&options](const std::vector<std::string>& texts) {
           options.lights.emplace();
           for (const std::string& text : texts) {
             if (texts.size() > 1 || text != "none") {
               options.lights->push_back(ValueOr("--light", ParseLight(text)));
             }
           }
         },
         "A light: X,Y,Z (direction of travel), point:X,Y,Z, camera, or none; repeatable; default: "
         "from the upper left of the view")
      ->type_name("LIGHT")
      ->allow_extra_args(false);
  AddEach(app, "--light-color", options.light_colors, ParseColor,
          "Colour of all lights, or repeated of each; default: 1", "R,G,B");
  AddEach(app, "--density", options.densities, ParseColor,
          "Shadow density, one number or R,G,B, of all lights, or repeated of each; default: 1",
          "R,G,B");
  app.add_flag("--falloff", options.falloff, "Point lights fall off with the squared distance");
}

void AddMaterialFlags(CLI::App& app, RenderOptions& options) {
  AddNumber(app, "--radius", options.radius, kRadius,
            "Radius of every particle, world units, also where the file has radii; default: the "
            "file's, or estimated from the spacing");
  AddNumber(app, "--opacity", options.opacity, {0, 1, "a number from 0 to 1"},
            "Opacity of every particle at its centre, also where the file has opacities; default: "
            "the file's, or 0.18");
  Add(app, "--albedo", options.albedo, ParseColor, "Multiplies the particles' colours", "R,G,B");
  Add(app, "--ambient", options.ambient, ParseColor, "Unshadowed light; default: 0.1", "R,G,B");
  Add(app, "--emission", options.emission, ParseColor,
      "Radiance of every particle, also where the file has emissions", "R,G,B");
  AddChoice<v1::Profile>(app, "--profile", options.profile,
                         {{"soft", v1::PROFILE_SOFT}, {"ball", v1::PROFILE_BALL}},
                         "How particles thin out towards their edge; default: soft");
  AddNumber(app, "--phase-g", options.phase_g,
            {-kBelowOne, kBelowOne, "a number from -0.9999999 to 0.9999999"},
            "Mean cosine of scattering; default: 0");
  auto* const spread = AddNumber(app, "--scattering", options.scattering_spread, kNotNegative,
                                 "Sideways spread of light a world unit; default: 0");
  AddNumber(app, "--scattering-g", options.scattering_g,
            {0, kBelowOne, "a number from 0 to 0.9999999"},
            "Scatter light as a physical medium of this mean cosine does")
      ->excludes(spread);
  AddNumber(app, "--scattering-albedo", options.scattering_albedo, {0, 1, "a number from 0 to 1"},
            "Share of the light that the physical medium scatters and does not absorb; default: 1")
      ->excludes(spread);
}

void AddShadowFlags(CLI::App& app, RenderOptions& options) {
  AddChoice<v1::ShadowTechnique>(
      app, "--technique", options.technique,
      {{"half-angle", v1::SHADOW_TECHNIQUE_HALF_ANGLE},
       {"light-sweep", v1::SHADOW_TECHNIQUE_LIGHT_SWEEP},
       {"particle-shadow-map", v1::SHADOW_TECHNIQUE_PARTICLE_SHADOW_MAP},
       {"reference", v1::SHADOW_TECHNIQUE_REFERENCE}},
      "How shadows are computed: by slices; along each light; from "
      "slices along each light, for comparison; or exactly, in float64 "
      "on the CPU. Default: light-sweep on servers without a GPU, unless "
      "something asks for slices (--slices, --plain, --spacing, "
      "--compositor, --blur, --blur-texels); otherwise half-angle");
  AddCount(app, "--fit-degree", options.fit_degree, 0, 6,
           "Degree in which light-sweep and particle-shadow-map keep the light over a particle; "
           "default: 4");
  AddCount(
      app, "--slices", options.slices, 1, INT32_MAX,
      "Slices of half-angle and particle-shadow-map, and of light-sweep where light scatters or "
      "layers are shown; default: 128");
  app.add_flag("--plain", options.plain, "Do not interpolate the light within half-angle's slices");
  AddChoice<v1::SliceSpacing>(app, "--spacing", options.spacing,
                              {{"count", v1::SLICE_SPACING_EQUAL_COUNT},
                               {"optical-depth", v1::SLICE_SPACING_EQUAL_OPTICAL_DEPTH}},
                              "What slices have in equal parts; default: count");
  AddChoice<v1::SliceCompositor>(
      app, "--compositor", options.compositor,
      {{"raster", v1::SLICE_COMPOSITOR_RASTER}, {"tiles", v1::SLICE_COMPOSITOR_TILES}},
      "What slices are drawn by: the blend units, or tiles in compute shaders; default: tiles on "
      "GPUs, raster on CPUs");
  AddCount(app, "--light-buffer", options.light_buffer_size, 16, 65536,
           "Width and height of the light buffer in texels; default: half-angle 512, others by "
           "the particles' radii, 64 to 1024");
  AddChoice<v1::BlurMode>(
      app, "--blur", options.blur_mode,
      {{"distance", v1::BLUR_MODE_DISTANCE}, {"texels", v1::BLUR_MODE_TEXELS_PER_SLICE}},
      "How --scattering blurs: by distance, or --blur-texels each slice");
  AddNumber(app, "--blur-texels", options.blur_texels, {0, 64, "a number > 0, 64 at most", false},
            "Blur of each slice in texels; implies --blur texels");
  auto* const supersample =
      AddCount(app, "--supersample", options.supersample, 1, 8, "N x N samples a pixel");
  AddCount(app, "--downsample", options.downsample, 1, 8, "One sample for N x N pixels")
      ->excludes(supersample);
  AddNumber(app, "--time-offset", options.time_offset_s,
            {-kLargestLength, kLargestLength, "seconds from -1e17 to 1e17"},
            "Move particles along their velocities by this many seconds");
}

void AddErrorFlags(CLI::App& app, RenderOptions& options) {
  // No value but behind "=": what follows may be the input.
  Add(app, "--measure-error", options.error_samples, ParseErrorSamples,
      "Measure how far the frame is from the image model, at 1024 random pixels or at SAMPLES of "
      "them",
      "")
      ->expected(0)
      ->option_text("[=SAMPLES]");
  Add(app, "--error-seed", options.error_seed, ParseSeed,
      "Chooses other random pixels for --measure-error; default: 0", "NUMBER");
  CLI::Option* const max_error =
      AddNumber(app, "--max-error", options.max_error, {0, 1, "a number > 0, 1 at most", false},
                "Choose the settings: the cheapest that come this close to the image model "
                "(relative RMSE, 0.05 is 5 %)");
  CLI::Option* const max_time =
      AddNumber(app, "--max-time", options.max_time_ms, kPositive,
                "Choose the settings: the most accurate that render in so many milliseconds")
          ->type_name("MS");
  for (const char* settings : {"--technique", "--slices", "--plain", "--spacing", "--compositor",
                               "--light-buffer", "--fit-degree", "--blur", "--blur-texels"}) {
    max_error->excludes(app.get_option(settings));
    max_time->excludes(app.get_option(settings));
  }
}

}  // namespace

void AddRenderFlags(CLI::App& app, RenderOptions& options) {
  struct Group {
    const char* name;
    void (*add)(CLI::App&, RenderOptions&);
  };
  for (const Group& group :
       {Group{"Files", AddFileFlags}, Group{"Storage", AddOutputFlags},
        Group{"Camera", AddCameraFlags}, Group{"Lights", AddLightFlags},
        Group{"Material", AddMaterialFlags}, Group{"Shadow and sampling", AddShadowFlags},
        Group{"Error", AddErrorFlags}}) {
    app.option_defaults()->group(group.name);
    group.add(app, options);
  }
  app.option_defaults()->group("Server and report");
  AddConnectionFlags(app, options.connection);
  app.add_option("--request-id", options.request_id, "Names the request in the server's log")
      ->type_name("ID");
  app.add_flag("--json", options.json, "Report on stdout as JSON, one line a frame; errors too");
  app.add_flag("-q,--quiet", options.quiet, "Say nothing but errors");
}

void AddInfoFlags(CLI::App& app, InfoOptions& options) {
  AddConnectionFlags(app, options.connection);
  app.add_flag("--json", options.json, "Report as JSON");
}

}  // namespace halflight::client
