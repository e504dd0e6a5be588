// From command lines to requests: flags alone, flags over a scene file, and what is refused.
#include "client/cli/flags.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>

#include "client/cli/flag_values.h"
#include "client/cli/frame_pattern.h"
#include "client/cli/request_builder.h"
#include "client/cli/request_json.h"
#include "client/status_text.h"
#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

using absl::StatusCode;
using testing::ElementsAre;
using testing::HasSubstr;

// What is said about a command line that is refused; empty where it is taken.
std::string Parse(std::vector<std::string> words, RenderOptions& options) {
  CLI::App app;
  AddRenderFlags(app, options);
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return "";
}

v1::RenderFrameRequest RequestOf(const std::vector<std::string>& words,
                                 v1::RenderFrameRequest request = {}) {
  RenderOptions options;
  EXPECT_EQ(Parse(words, options), "");
  const absl::Status status = ApplyFlags(options, request);
  EXPECT_TRUE(status.ok()) << status;
  return request;
}

std::string ErrorOf(const std::vector<std::string>& words) {
  RenderOptions options;
  std::string error = Parse(words, options);
  if (error.empty()) {
    v1::RenderFrameRequest request;
    error = MessageOf(ApplyFlags(options, request));
  }
  return error;
}

void ExpectJson(const v1::RenderFrameRequest& request, const std::string& json) {
  const auto expected = ParseRequestJson(json);
  ASSERT_TRUE(expected.ok()) << expected.status();
  EXPECT_EQ(RequestToJson(request), RequestToJson(*expected));
}

TEST(RenderFlags, LeaveUnsetWhatIsNotGiven) {
  ExpectJson(RequestOf({"a.ply"}), R"({"scene": {"camera": {}}})");
}

TEST(RenderFlags, SetEveryFieldOfTheRequest) {
  ExpectJson(RequestOf({"a.ply",
                        "-o",
                        "a.png",
                        "--size",
                        "320x200",
                        "--crop",
                        "1,2,30,40",
                        "--eye",
                        "-.5,1,-2e3",
                        "--target",
                        "0,0,1",
                        "--up",
                        "0,0,1",
                        "--fov",
                        "30",
                        "--light",
                        "-1,-1,0",
                        "--light",
                        "point:1,2,3",
                        "--light-color",
                        "2",
                        "--density",
                        "0.5",
                        "--density",
                        "1,2,3",
                        "--falloff",
                        "--radius",
                        "0.25",
                        "--opacity",
                        "0.5",
                        "--albedo",
                        "1,0.5,0",
                        "--ambient",
                        "0",
                        "--emission",
                        "0,0,1",
                        "--profile",
                        "ball",
                        "--phase-g",
                        "-0.5",
                        "--scattering",
                        "0.125",
                        "--technique",
                        "half-angle",
                        "--slices",
                        "33",
                        "--plain",
                        "--spacing",
                        "optical-depth",
                        "--compositor",
                        "tiles",
                        "--light-buffer",
                        "1024",
                        "--blur-texels",
                        "1.5",
                        "--supersample",
                        "2",
                        "--time-offset",
                        "-0.25",
                        "--request-id",
                        "me"}),
             R"({"scene": {
            "time_offset_s": -0.25,
            "camera": {"look_at": {"eye": {"x": -0.5, "y": 1, "z": -2000}, "target": {"z": 1},
                                   "up": {"z": 1}},
                       "perspective": {"vertical_fov_deg": 30}, "width": 320, "height": 200,
                       "crop": {"x": 1, "y": 2, "width": 30, "height": 40}},
            "lighting": {"lights": [
              {"directional": {"direction": {"x": -1, "y": -1}},
               "color": {"r": 2, "g": 2, "b": 2}, "density": 0.5},
              {"point": {"position": {"x": 1, "y": 2, "z": 3}, "inverse_square_falloff": true},
               "color": {"r": 2, "g": 2, "b": 2}, "density_rgb": {"r": 1, "g": 2, "b": 3}}]},
            "material": {"profile": "PROFILE_BALL", "radius": 0.25, "opacity": 0.5,
                         "albedo": {"r": 1, "g": 0.5}, "ambient": {}, "emission": {"b": 1},
                         "phase_g": -0.5, "scattering_spread": 0.125},
            "shadow": {"technique": "SHADOW_TECHNIQUE_HALF_ANGLE", "slices": 33,
                       "interpolate": false, "spacing": "SLICE_SPACING_EQUAL_OPTICAL_DEPTH",
                       "compositor": "SLICE_COMPOSITOR_TILES",
                       "light_buffer_size": 1024, "blur_mode": "BLUR_MODE_TEXELS_PER_SLICE",
                       "blur_texels": 1.5},
            "sampling": {"supersample": 2}},
          "outputs": [{"kind": "OUTPUT_KIND_BEAUTY", "format": "IMAGE_FORMAT_PNG8"}],
          "request_id": "me"})");
}

TEST(RenderFlags, ChooseFormatsByExtensionAndStorageFlags) {
  ExpectJson(RequestOf({"-o", "a.png", "-o", "depth=z.exr", "-o", "light=l.EXR", "-o",
                        "layers=d/l.raw", "-o", "coverage=c.bin", "-o", "transmittance=t.png",
                        "--bits", "16", "--exr-compression", "piz", "--output-light", "1"}),
             R"({"scene": {"camera": {}}, "outputs": [
                   {"kind": 1, "format": "IMAGE_FORMAT_PNG16"},
                   {"kind": 3, "format": "IMAGE_FORMAT_EXR_FLOAT", "compression": 5},
                   {"kind": 5, "format": "IMAGE_FORMAT_EXR_HALF", "compression": 5,
                    "light_index": 1},
                   {"kind": 6, "format": "IMAGE_FORMAT_RAW_FLOAT", "light_index": 1},
                   {"kind": 2, "format": "IMAGE_FORMAT_RAW_FLOAT"},
                   {"kind": 4, "format": "IMAGE_FORMAT_PNG16", "light_index": 1}]})");
  ExpectJson(RequestOf({"-o", "light=l.exr", "--quantity", "optical-depth"}),
             R"({"scene": {"camera": {}}, "outputs": [
                   {"kind": 5, "format": "IMAGE_FORMAT_EXR_FLOAT", "quantity": 2}]})");
  ExpectJson(RequestOf({"-o", "a.exr", "--exr", "float"}),
             R"({"scene": {"camera": {}}, "outputs": [
                   {"kind": 1, "format": "IMAGE_FORMAT_EXR_FLOAT"}]})");
}

TEST(RenderFlags, MeasureTheErrorWithAValueBehindTheSignOfEqualityAlone) {
  RenderOptions options;
  EXPECT_EQ(Parse({"--measure-error", "in.ply"}, options), "");
  EXPECT_EQ(options.input, "in.ply");
  ExpectJson(RequestOf({"in.ply", "--measure-error"}),
             R"({"scene": {"camera": {}}, "measure_error": {}})");
  ExpectJson(RequestOf({"--measure-error=4096", "--error-seed", "18446744073709551615", "in.ply"}),
             R"({"scene": {"camera": {}},
                 "measure_error": {"samples": 4096, "seed": "18446744073709551615"}})");
  const auto scene = ParseRequestJson(R"({"measure_error": {"samples": 64, "seed": 1}})");
  ASSERT_TRUE(scene.ok());
  ExpectJson(RequestOf({"--error-seed", "2"}, *scene),
             R"({"scene": {"camera": {}}, "measure_error": {"samples": 64, "seed": "2"}})");
}

TEST(RenderFlags, TargetAndSettingsTakeEachOthersPlace) {
  ExpectJson(RequestOf({"in.ply", "--max-error", "0.05", "--max-time", "40"}),
             R"({"scene": {"camera": {}}, "target": {"max_error": 0.05, "max_time_ms": 40}})");
  const auto settings = ParseRequestJson(R"({"scene": {"shadow": {"slices": 7}}})");
  ASSERT_TRUE(settings.ok());
  ExpectJson(RequestOf({"--max-error", "1"}, *settings),
             R"({"scene": {"camera": {}}, "target": {"max_error": 1}})");
  const auto target = ParseRequestJson(R"({"target": {"max_error": 0.05}})");
  ASSERT_TRUE(target.ok());
  ExpectJson(RequestOf({"--slices", "7"}, *target),
             R"({"scene": {"camera": {}, "shadow": {"slices": 7}}})");
  ExpectJson(RequestOf({"--fit-degree", "2"}, *target),
             R"({"scene": {"camera": {}, "shadow": {"fit_degree": 2}}})");
  ExpectJson(RequestOf({"--max-time", "40"}, *target),
             R"({"scene": {"camera": {}}, "target": {"max_error": 0.05, "max_time_ms": 40}})");
  ExpectJson(
      RequestOf({"--size", "10x10"}, *target),
      R"({"scene": {"camera": {"width": 10, "height": 10}}, "target": {"max_error": 0.05}})");
  for (const char* flag :
       {"--technique=reference", "--slices=7", "--plain", "--spacing=count", "--compositor=tiles",
        "--light-buffer=64", "--blur=distance", "--blur-texels=2"}) {
    const std::string name = std::string(flag).substr(0, std::string(flag).find('='));
    EXPECT_THAT(ErrorOf({flag, "--max-error", "0.05"}),
                testing::AllOf(HasSubstr(name), HasSubstr("--max-error")));
    EXPECT_THAT(ErrorOf({flag, "--max-time", "5"}),
                testing::AllOf(HasSubstr(name), HasSubstr("--max-time")));
  }
}

TEST(RenderFlags, StoreTheErrorInFloats) {
  ExpectJson(RequestOf({"-o", "error=e.exr", "-o", "error=e.png"}),
             R"({"scene": {"camera": {}}, "outputs": [
                   {"kind": "OUTPUT_KIND_ERROR", "format": "IMAGE_FORMAT_EXR_FLOAT"},
                   {"kind": "OUTPUT_KIND_ERROR", "format": "IMAGE_FORMAT_PNG8"}]})");
}

TEST(RenderFlags, OverrideTheSceneFileFieldByField) {
  const auto scene = ParseRequestJson(
      R"({"scene": {"camera": {"look_at": {"eye": {"z": 5}, "target": {}}, "width": 100},
                    "lighting": {"lights": [{"point": {"position": {"x": 1}}}]},
                    "material": {"radius": 0.5, "opacity": 0.25},
                    "sampling": {"downsample": 2}},
          "outputs": [{"kind": "OUTPUT_KIND_BEAUTY"},
                      {"kind": "OUTPUT_KIND_LIGHT_LAYERS", "light_index": 1, "compression": 4}]})");
  ASSERT_TRUE(scene.ok());
  ExpectJson(
      RequestOf({"--target", "1,1,1", "--ortho-height", "3", "--opacity", "0.5", "--light-color",
                 "1,0,0", "--supersample", "4", "-o", "layers=l.exr"},
                *scene),
      R"({"scene": {"camera": {"look_at": {"eye": {"z": 5}, "target": {"x": 1, "y": 1, "z": 1}},
                                      "orthographic": {"height": 3}, "width": 100},
                           "lighting": {"lights": [{"point": {"position": {"x": 1}},
                                                    "color": {"r": 1}}]},
                           "material": {"radius": 0.5, "opacity": 0.5},
                           "sampling": {"supersample": 4}},
                 "outputs": [{"kind": 6, "format": "IMAGE_FORMAT_EXR_HALF", "light_index": 1,
                              "compression": 4}]})");
}

TEST(RenderFlags, ScatterByAMediumInPlaceOfASpread) {
  ExpectJson(RequestOf({"--scattering-g", "0.75", "--scattering-albedo", "0.5"}),
             R"({"scene": {"camera": {}, "material": {"physical_scattering":
                   {"mean_cosine": 0.75, "albedo": 0.5}}}})");
  ExpectJson(RequestOf({"--scattering-albedo", "1"}),
             R"({"scene": {"camera": {}, "material": {"physical_scattering": {"albedo": 1}}}})");
}

TEST(RenderFlags, TakeOneValueEachSoThatTheInputMayComeLast) {
  RenderOptions options;
  EXPECT_EQ(Parse({"-o", "a.png", "--light", "camera", "--density", "2", "in.ply"}, options), "");
  EXPECT_EQ(options.input, "in.ply");
  EXPECT_EQ(options.outputs.size(), 1U);
}

TEST(RenderFlags, TakeTheFarthestThatTheServerTakes) {
  RenderOptions options;
  EXPECT_EQ(Parse({"--eye", "1e18,0,-1e18", "--light", "point:1e18,0,0", "--light", "1e30,0,0",
                   "--up", "0,1e30,0", "--ortho-height", "1e-15", "--time-offset", "-1e17",
                   "--phase-g", "-0.9999999", "--scattering-g", "0.9999999"},
                  options),
            "");
  EXPECT_LT(static_cast<float>(*options.scattering_g), 1.0F);
}

TEST(RenderFlags, TellNoLightsFromNoFlag) {
  EXPECT_FALSE(RequestOf({"a.ply"}).scene().has_lighting());
  EXPECT_TRUE(RequestOf({"a.ply", "--light", "none"}).scene().has_lighting());
  EXPECT_EQ(RequestOf({"a.ply", "--light", "none"}).scene().lighting().lights_size(), 0);
}

TEST(RenderFlags, NameTheFlagTheValueAndWhatIsAllowed) {
  struct Case {
    std::vector<std::string> words;
    std::vector<std::string> message;
  };
  for (const Case& bad : {
           Case{{"--size", "640"}, {"--size", "'640'", "WIDTHxHEIGHT"}},
           Case{{"--size", "0x4"}, {"--size", "'0x4'"}},
           Case{{"--eye", "1,2"}, {"--eye", "'1,2'", "x,y,z"}},
           Case{{"--eye", "1,2,nan"}, {"--eye", "'1,2,nan'"}},
           Case{{"--eye", "0,0,1.1e18"}, {"--eye", "'0,0,1.1e18'", "-1e18 to 1e18"}},
           Case{{"--target", "-2e18,0,0"}, {"--target", "'-2e18,0,0'", "-1e18 to 1e18"}},
           Case{{"--light", "point:0,2e18,0"}, {"--light", "'point:0,2e18,0'", "-1e18 to 1e18"}},
           Case{{"--ortho-height", "1e-16"}, {"--ortho-height", "'1e-16'", "1e-15 to 1e18"}},
           Case{{"--ortho-height", "2e18"}, {"--ortho-height", "'2e18'", "1e-15 to 1e18"}},
           Case{{"--time-offset", "2e17"}, {"--time-offset", "'2e17'", "-1e17 to 1e17"}},
           Case{{"--fov", "179"}, {"--fov", "'179'", "< 179"}},
           Case{{"--fov", "wide"}, {"--fov", "'wide'"}},
           Case{{"--radius", "0"}, {"--radius", "'0'", "1e-15 to 1e17"}},
           Case{{"--opacity", "1.01"}, {"--opacity", "'1.01'", "0 to 1"}},
           Case{{"--albedo", "1,2"}, {"--albedo", "'1,2'", "r,g,b"}},
           Case{{"--density", "-1"}, {"--density", "'-1'", "from 0"}},
           // Infinite as the 32-bit floats that they become.
           Case{{"--density", "1e39"}, {"--density", "'1e39'", "3e38"}},
           Case{{"--scattering", "1e39"}, {"--scattering", "'1e39'", "3e38"}},
           Case{{"--scattering-albedo", "1.5"}, {"--scattering-albedo", "'1.5'", "0 to 1"}},
           Case{{"--scattering", "0.1", "--scattering-g", "0.5"}, {"--scattering"}},
           Case{{"--radius", "1e39"}, {"--radius", "'1e39'"}},
           // 1 as the 32-bit floats that they become.
           Case{{"--phase-g", "0.99999999"}, {"--phase-g", "'0.99999999'", "0.9999999"}},
           Case{{"--phase-g", "-0.99999999"}, {"--phase-g", "-0.9999999 to 0.9999999"}},
           Case{{"--scattering-g", "0.99999999"}, {"--scattering-g", "0 to 0.9999999"}},
           Case{{"--slices", "0"}, {"--slices", "'0'", "from 1"}},
           Case{{"--slices", "1.5"}, {"--slices", "'1.5'"}},
           Case{{"--profile", "hard"}, {"--profile", "'hard'", "soft|ball"}},
           Case{{"--light", "up"}, {"--light", "'up'", "x,y,z", "point:x,y,z", "camera"}},
           Case{{"--light", "0,0,0"}, {"--light", "'0,0,0'"}},
           Case{{"--format", "obj"}, {"--format", "'obj'", "ply, csv, npy, raw"}},
           Case{{"--frames", "5-1"}, {"--frames", "'5-1'", "24-40x2"}},
           Case{{"-o", "bump=a.png"}, {"--output", "'bump=a.png'", "beauty, coverage"}},
           Case{{"-o", "a.jpg"}, {"--output", "'a.jpg'", "'.jpg'", ".png, .exr, .raw, .bin"}},
           Case{{"-o", "a.exr", "--bits", "16"}, {"--bits", ".png"}},
           Case{{"-o", "a.png", "--exr", "half"}, {"--exr", ".exr"}},
           Case{{"--bits", "12"}, {"--bits", "'12'", "8|16"}},
           Case{{"-o", "transmittance=t.exr", "--quantity", "optical-depth"},
                {"--quantity", "--output light or layers"}},
           // There is no output that they could be of, such as with --print-scene.
           Case{{"--bits", "16"}, {"--bits", "--output that ends in .png"}},
           Case{{"--exr", "float"}, {"--exr", "--output that ends in .exr"}},
           Case{{"--exr-compression", "zip"}, {"--exr-compression", "--output"}},
           Case{{"--quantity", "transmittance"}, {"--quantity", "--output"}},
           Case{{"--output-light", "1"}, {"--output-light", "--output"}},
           Case{{"--timeout", "-1"}, {"--timeout", "'-1'"}},
           Case{{"--fov", "40", "--ortho"}, {"--fov", "--ortho"}},
           Case{{"--supersample", "2", "--downsample", "2"}, {"--supersample", "--downsample"}},
           Case{{"--server", "a:1", "--device", "b"}, {"--server", "--device"}},
           Case{{"--light", "camera", "--density", "1", "--density", "2"},
                {"--density", "2 times for 1 lights"}},
           Case{{"--light", "none", "--light-color", "1"}, {"--light-color", "0 lights"}},
           Case{{"--light", "camera", "--falloff"}, {"--falloff", "point"}},
           Case{{"--measure-error=31"}, {"--measure-error", "'31'", "from 32 to 1048576"}},
           Case{{"--measure-error=few"}, {"--measure-error", "'few'"}},
           Case{{"--measure-error", "--error-seed", "-1"}, {"--error-seed", "'-1'"}},
           Case{{"--error-seed", "1"}, {"--error-seed", "--measure-error"}},
           Case{{"--max-error", "0"}, {"--max-error", "'0'", "> 0, 1 at most"}},
           Case{{"--max-error", "5"}, {"--max-error", "'5'"}},
           Case{{"--max-time", "-1"}, {"--max-time", "'-1'"}},
           Case{{"--no-such-flag"}, {"--no-such-flag"}},
       }) {
    const std::string error = ErrorOf(bad.words);
    for (const std::string& text : bad.message) {
      EXPECT_THAT(error, HasSubstr(text)) << bad.words[0];
    }
  }
}

TEST(RequestJson, SurvivesTheRoundTrip) {
  const v1::RenderFrameRequest request =
      RequestOf({"-o", "a.png", "--eye", "0.1,0.2,0.3", "--light", "1,2,3", "--radius", "0.045"});
  const auto again = ParseRequestJson(RequestToJson(request));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->SerializeAsString(), request.SerializeAsString());
}

TEST(RequestJson, NamesWhatItCannotRead) {
  ExpectError(ParseRequestJson(R"({"scene": {"camra": {}}})").status(),
              StatusCode::kInvalidArgument, {"camra"});
  ExpectError(ParseRequestJson("{").status(), StatusCode::kInvalidArgument, {"RenderFrameRequest"});
}

TEST(ParseFrames, ReadsNumbersRangesAndSteps) {
  EXPECT_THAT(*ParseFrames("7"), ElementsAre(7));
  EXPECT_THAT(*ParseFrames("24-27"), ElementsAre(24, 25, 26, 27));
  EXPECT_THAT(*ParseFrames("24-31x3"), ElementsAre(24, 27, 30));
  EXPECT_THAT(*ParseFrames("9, 1-2 ,5"), ElementsAre(9, 1, 2, 5));
  EXPECT_THAT(*ParseFrames("3-3"), ElementsAre(3));
}

TEST(ParseFrames, RefusesTheRest) {
  for (const char* text : {"", "a", "-3", "4-", "5-4", "1-5x0", "1x2", "1,,2", "1,1-3", "1-5x",
                           "0-2000000", "1-18446744073709551615"}) {
    ExpectError(ParseFrames(text).status(), StatusCode::kInvalidArgument,
                {std::string("'") + text + "'", "24-40x2"});
  }
}

TEST(FramePattern, PutsTheNumberIn) {
  EXPECT_EQ(ExpandPattern("a.%04d.ply", 24), "a.0024.ply");
  EXPECT_EQ(ExpandPattern("a%d", 24), "a24");
  EXPECT_EQ(ExpandPattern("%02d/100%%.ply", 12345), "12345/100%.ply");
}

TEST(FramePattern, HasExactlyOneNumber) {
  EXPECT_TRUE(CheckPattern("a.%04d.ply").ok());
  for (const char* pattern : {"a.ply", "%d.%d", "%s", "a%", "%04x", "%-4d", "a.%%d"}) {
    ExpectError(CheckPattern(pattern), StatusCode::kInvalidArgument, {pattern, "name.%04d.ext"});
  }
}

}  // namespace
}  // namespace halflight::client
