// What every hard case is held to: the model, exact half-angle slicing, and loops.
#pragma once

#include <string>

#include "tests/hard_cases/figure.h"
#include "tests/renderer/gl_fixture.h"

namespace halflight::test {

// Bounds, near what is reached.
struct Allowed {
  double coverage;  // from the image model, the largest error
  double slicing;   // from half-angle slicing with an ideal light buffer, relative RMSE
  double model;     // from the image model, relative RMSE: what half-angle slicing itself is off by
  double reference;  // of the reference technique from loops over all particles, largest error
};

class HardCase : public GlTest {
 protected:
  // Draws the scene by half-angle slicing and by the reference, and holds both to `allowed`.
  static void Hold(const std::string& subject, const Scene& scene, const Allowed& allowed);

  // The last of these alone.
  static void HoldReference(const std::string& subject, const Scene& scene, double allowed);
};

// A light at a place, as bright everywhere.
Light Lamp(const glm::dvec3& position);

// The scene's particles, to be changed.
ParticleSet& EditParticles(Scene& scene);

// Largest difference of the A of a beauty image from `expected`.
double CoverageError(const Image& beauty, double expected);

// How many floats of two images differ in any bit.
double DifferentFloats(const Image& a, const Image& b);

}  // namespace halflight::test
