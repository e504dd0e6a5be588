// Pictures of frames, of what they should be, and of the difference.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "renderer/frame_renderer.h"
#include "tests/report/measure.h"

namespace halflight::report {

struct Picture {
  std::string file;  // its name
  std::string png;
};

// One scene: the reference, then for each of the settings the frame and its error map.
struct Example {
  size_t scene;
  Picture exact;
  std::vector<Picture> frames;
  std::vector<Picture> error_maps;
};

// Of the last plume's dense scenes, cut to what the particles cover, on a dark ground. `settings`
// are places in Results::settings. The renderer's thread. Errors as FrameRenderer::Render, and
// those of the image library.
absl::StatusOr<std::vector<Example>> DrawExamples(FrameRenderer& renderer, const Results& results,
                                                  const std::vector<size_t>& settings);

}  // namespace halflight::report
