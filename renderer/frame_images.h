// Turns what was drawn into the images that were asked for. Draws and reads back nothing: no GL.
#pragma once

#include <vector>

#include "renderer/frame.h"
#include "renderer/image.h"
#include "renderer/scene.h"

namespace halflight {

// What a technique leaves of a light besides its part of the image.
struct ShadowResult {
  // Optical depth in the light buffer behind all particles, and after every slice: one or three
  // channels, empty unless an output shows them.
  Image light_buffer;
  Image light_layers;
};

// What a technique leaves behind, by kind of image.
struct DrawnImages {
  Image beauty;                       // R G B A
  Image depth;                        // depth * alpha, alpha in A
  std::vector<Image> transmittance;   // by light: R G B * alpha, alpha
  std::vector<ShadowResult> shadows;  // by light
};

// The images that were asked for. The last beauty among them takes what was drawn, uncopied.
std::vector<Image> SelectImages(const FrameRequest& request, DrawnImages&& drawn);

// The alpha channel of a composited image.
Image CoverageOf(const Image& image);

// Mean depth from a (depth * alpha, , , alpha) target: +infinity where alpha is 0.
Image DepthOf(const Image& target);

// Mean transmittance from a (R G B * alpha, alpha) target: 1 where alpha is 0. `colored`: three
// channels instead of one.
Image TransmittanceOf(const Image& target, bool colored);

// Light buffers as read are optical depths; as asked, that or exp(-density * optical depth), with
// three channels where the light's density is coloured.
Image LightImage(const Image& optical_depth, LightQuantity quantity, const Light& light);

}  // namespace halflight
