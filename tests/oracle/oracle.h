// Half-angle slicing evaluated on the CPU in float64, beside the image model itself, to judge
// renderers by. Written from the definitions alone, without any of the GL path's code. Leaves out
// what is an approximation by intent: blur, and images composited at a lower resolution.
#pragma once

#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "renderer/scene.h"

namespace halflight::oracle {

struct OracleOptions {
  int stride = 1;  // evaluates every stride-th pixel of every stride-th row only
  int threads = 2;
};

// The camera's window, or some of its pixels: all vectors have one element for each of `pixels`.
struct OracleImage {
  int width = 0;  // of the window
  int height = 0;
  std::vector<glm::ivec2> pixels;  // places in the window, row by row from the top
  std::vector<glm::dvec4> rgba;    // premultiplied
  std::vector<double> depth;       // as reference::PixelValues
  std::vector<std::vector<glm::dvec3>> transmittance;  // by light
};

// The model without shadows: all light arrives, particles in the order of the distance of x_i.
OracleImage RenderUnshadowed(const Scene& scene, const OracleOptions& options = {});

// The model with its shadows.
OracleImage RenderExact(const Scene& scene, const OracleOptions& options = {});

// Half-angle slicing with an ideal light buffer: optical depth is that of the slices before a
// particle's own, evaluated at x_i, and when interpolated also its share of its own slice. Each
// light that casts shadows has its own axis and walk; the first of these walks (where there is
// none, one by the distance of the centres) also adds ambient light, emission, and the lights
// without shadows.
OracleImage RenderHalfAngle(const Scene& scene, const OracleOptions& options = {});

}  // namespace halflight::oracle
