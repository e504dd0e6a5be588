// The light buffer of one light, and the passes that write it.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "renderer/gpu.h"
#include "renderer/light_spread.h"
#include "renderer/passes/project.h"
#include "renderer/scene.h"

namespace halflight {

// A texture of optical depth, seen from the light, with the framebuffer that draws into it.
struct LightBuffer {
  gl::Texture texture;
  gl::Framebuffer framebuffer;
};

// What the light buffers of a traversal hold.
struct LightChannels {
  bool colored = false;      // an optical depth for each colour instead of one for all
  bool unscattered = false;  // beside it that of the light that has not been scattered
};

// Zeroed.
LightBuffer MakeLightBuffer(const char* label, int size, const LightChannels& channels);

// Adds particles [begin, end) of the order to `target`. `light` is the projection of the splats.
absl::Status DepositSlice(Gpu& gpu, const gl::Buffer& light_splats, const TargetProjection& light,
                          Profile profile, const LightChannels& channels, uint32_t begin,
                          uint32_t end, const LightBuffer& target);

void CopyLightBuffer(const LightBuffer& from, const LightBuffer& to);

// Spreads the light in `buffer`, or where it holds the unscattered light, what is scattered.
// `density` is the light's shadow density; red serves for a buffer that is not colored. `scratch`
// is of the same size, its contents are lost.
absl::Status BlurLightBuffer(Gpu& gpu, LightBuffer& buffer, LightBuffer& scratch,
                             const BlurVariance& variance, const glm::vec3& density,
                             const LightChannels& channels);

}  // namespace halflight
