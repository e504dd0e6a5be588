// What must hold of frames of any scene, as figures: how far a renderer is from it.
// Judges any renderer it is handed, so that one with a fault can be shown to be caught.
#pragma once

#include <functional>
#include <vector>

#include "renderer/frame.h"
#include "tests/hard_cases/random_scene.h"

namespace halflight::fuzz {

using Render = std::function<FrameResult(const FrameRequest&)>;

struct Property {
  const char* name;
  double bound;  // of the deviation, where there is only arithmetic to it
  // The same of SOFT particles where texels of a light buffer show; 0 where they make no
  // difference.
  double bound_with_light_buffer;
  // How far `render` is from the property at this scene, relative to the image's brightness.
  double (*deviation)(const Render& render, const Scene& scene, Dice& dice);
};

// The bound of the two that applies.
double BoundOf(const Property& property, const Scene& scene);

// Each under its name, as in "IgnoresOrderOfParticles".
const std::vector<Property>& Properties();

}  // namespace halflight::fuzz
