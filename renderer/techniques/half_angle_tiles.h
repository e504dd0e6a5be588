// Slices by tiles, in compute: the light walks slice after slice into layers of light buffers, and
// tiles of the image then walk the particles of all those slices at once. Neither touches the blend
// units, and the image is loaded and stored once a run of slices instead of once a slice.
//
// What limits it: the layers, so that slices go in runs of as many as 128 MiB hold; and tiles, as
// renderer/sweep/device/compositor.h says. With blur the light takes a dispatch a slice, else one a
// run.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "renderer/frame_images.h"
#include "renderer/passes/composite.h"
#include "renderer/passes/light_buffer.h"
#include "renderer/passes/project.h"
#include "renderer/techniques/traversal_context.h"

namespace halflight {

// What drawing the slices of one light begins with, by either path.
struct SlicedLight {
  const DeviceOrder& order;
  const TargetProjection& light;
  const gl::Buffer& splats;  // the light's
  const CompositePass& composite;
  LightChannels channels;
  // Lets the light in `buffer` spread between two positions along the axis. `scratch` is as large.
  std::function<absl::Status(double from, double to, LightBuffer& buffer, LightBuffer& scratch)>
      blur;
};

// The eye pass, for people.
PlannedPass DescribeCompositeInTiles();

// Draws the traversal's slices into the context's targets. Cancelled when the context's stop token
// says so. Needs the GL context.
absl::Status DrawSlicesInTiles(const TraversalContext& context, const SlicedLight& sliced,
                               ShadowResult& shadow);

// Draws a traversal that casts no shadows.
absl::Status DrawUnshadowedInTiles(const TraversalContext& context, const CompositePass& composite);

// An image of the traversal's light buffer as it stands at so many times, without pixels.
Image DescribeLightImage(const Traversal& traversal, int layers);

}  // namespace halflight
