// What lives on the device between frames, and the particles of one frame on it.
#pragma once

#include <epoxy/gl.h>

#include "renderer/gl/object.h"
#include "renderer/gl/program.h"
#include "renderer/particle_order.h"
#include "renderer/particle_view.h"

namespace halflight {

// Needs the context that it was made with current.
struct Gpu {
  gl::ProgramCache programs;
  gl::VertexArray no_vertices;  // all vertices are computed from gl_VertexID

  Gpu() {
    GLuint name = 0;
    glCreateVertexArrays(1, &name);
    no_vertices = gl::VertexArray(name);
  }
};

// A frame's particles in the set's own order; attributes that the set lacks stay empty buffers.
struct ParticleBuffers {
  size_t count = 0;
  bool has_radii = false;
  bool has_optical_depths = false;
  bool has_colors = false;
  bool has_emissions = false;
  gl::Buffer uniforms;  // shader::ParticlesBlock
  gl::Buffer positions;
  gl::Buffer radii;
  gl::Buffer optical_depths;
  gl::Buffer colors;
  gl::Buffer emissions;
};

ParticleBuffers UploadParticles(const ParticleView& particles);

// One traversal's order on the device, and quads for its largest slice.
struct OrderBuffers {
  gl::Buffer order;         // shader::OrderedParticle[]
  gl::Buffer quad_indices;  // two triangles a particle, for a slice that begins at vertex 0
};

OrderBuffers UploadOrder(const ParticleOrder& order);

// Draws particles [begin, end) of the order as quads of four vertices, numbered 4 k + corner.
void DrawQuads(const Gpu& gpu, const OrderBuffers& order, uint32_t begin, uint32_t end);

// Draws one triangle over the whole target.
void DrawFullscreen(const Gpu& gpu);

}  // namespace halflight
