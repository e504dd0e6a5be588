// Other scenes that show the same picture: moved, scaled or turned as a whole, or said otherwise.
// Renders nothing.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "renderer/scene.h"

namespace halflight::test {

// By the set's origin, so that the particles' offsets keep their bits.
Scene Moved(Scene scene, const glm::dvec3& by);

// Lengths from the world's origin by `factor` > 0; lights that fall off stay as bright.
Scene Scaled(Scene scene, double factor);

// About the world's origin.
Scene Turned(Scene scene, const glm::dmat3& rotation);

// Every attribute given by the particles.
Scene WithOwnAttributes(Scene scene);

}  // namespace halflight::test
