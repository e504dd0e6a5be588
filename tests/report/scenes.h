// The scenes that the report measures: which plume, how opaque, lit from where.
// Leaves out how they are drawn; see settings.h.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/scene.h"

namespace halflight::report {

// Which part of the report a scene belongs to.
enum class Part : uint8_t { kMatrix, kScaling };

struct ReportScene {
  std::string name;     // in the table and in names of files
  std::string plume;    // "0024", "0040"
  std::string light;    // one of LightNames()
  std::string opacity;  // one of Opacities()
  Part part;
  bool scaling_baseline = false;  // the number of particles that the others' times are ratios to
  Scene scene;
};

struct SceneOptions {
  std::string data_folder;  // holds plume/plume.0024.ply and plume.0040.ply
  bool short_form = false;  // few scenes, of few pixels
};

// Where the light travels, against the direction in which the camera looks: 0 is a light beside the
// camera, 180 one that shines into it.
double DegreesFromView(const std::string& light);

std::vector<std::string> LightNames();

// For people, with the angle: "side (67°)".
std::string LightTitle(const std::string& light);

// Name, and the opacity of one particle of the plume as it is.
std::vector<std::pair<std::string, float>> Opacities();

// Of the matrix, then by rising number of particles, one of them the scaling baseline. NotFound,
// naming the file, where a plume cannot be read.
absl::StatusOr<std::vector<ReportScene>> LoadScenes(const SceneOptions& options);

}  // namespace halflight::report
