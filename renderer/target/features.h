// What of a scene decides how long its frames take and how wrong they are, in a few numbers.
// No settings: those are in candidates.h.
#pragma once

#include <vector>

#include "renderer/scene.h"

namespace halflight {

// Of a light that casts shadows.
struct LightFeatures {
  double share = 0.0;   // of the light of all lights, before shadows
  double cosine = 0.0;  // between view direction and direction of travel
  // Sprites' quads in the light buffer, added up, in areas of the buffer.
  double quad_area = 0.0;
  double radius = 0.0;  // of a particle, root mean square, in sides of the buffer
  // Shadow density times optical depth through the cloud, mean over the light buffer.
  double depth = 0.0;
  bool among_particles = false;  // a point light within the bounds of the particles
};

struct SceneFeatures {
  double particles = 0.0;
  double pixels = 0.0;          // of the window
  double samples = 0.0;         // of the window, supersampled
  double quad_samples = 0.0;    // sprites' quads in the window, added up, in samples
  double radius_samples = 0.0;  // of a particle that is seen, root mean square, along a side
  double optical_depth = 0.0;   // of a particle at its centre, mean
  bool scatters = false;
  std::vector<LightFeatures> lights;
};

// From every n-th particle, a few thousand of them. Any thread; takes about as long as sorting the
// particles.
SceneFeatures FeaturesOf(const Scene& scene);

// Samples times particles, in the sense of ServerLimits.max_reference_work, of evaluating the image
// model at so many pixels: it takes time in proportion to what it samples and to what each sample
// may meet; and however few samples there are, memory in proportion to the particles.
double ReferenceWork(const Scene& scene, double pixels);

}  // namespace halflight
