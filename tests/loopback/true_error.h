// The plume small enough to be measured often, and how far a frame that came over the wire is from
// the image model in truth: from the error at each of its pixels.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/client.h"
#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/oracle/plume.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {

// A server, and a client of it that sends the particles with each frame asked for.
class WireTest : public ::testing::Test {
 protected:
  client::RenderedFrame Render(const v1::RenderFrameRequest& request, const Scene& scene) {
    const client::EncodedParticles particles = Encoded(*scene.particles);
    return MustRender(client_, request, &particles);
  }

  const TestServer server_;
  client::Client client_ = server_.Connect();
};

inline Scene Plume() {
  Scene scene;
  scene.particles = oracle::LoadPlume(std::string(HALFLIGHT_TEST_DATA) + "/plume/plume.0040.ply");
  scene.camera = test::LookAt({0.5, 1.5, 4.6}, {0, 1.25, 0}, 160, 120);
  scene.lights = {test::Sun({1, -0.6, -0.6})};
  scene.material.radius = 0.045F;
  scene.shadow.slices = 64;
  scene.shadow.light_buffer_size = 256;
  return scene;
}

// Asks for raw floats of these, without sending the particles.
inline v1::RenderFrameRequest RequestFor(const Scene& scene,
                                         const std::vector<v1::OutputKind>& kinds) {
  v1::RenderFrameRequest request = RequestWithoutParticles(scene);
  for (const v1::OutputKind kind : kinds) {
    *request.add_outputs() = OutputOf(kind);
  }
  return request;
}

// The truth, from a beauty and its error at every pixel.
struct Truth {
  double mse = 0.0;
  double bias = 0.0;
  double relative_rmse = 0.0;
  double max = 0.0;
  uint64_t covered = 0;

  Truth(const std::vector<float>& beauty, const std::vector<float>& error) {
    double reference = 0.0;
    for (size_t i = 0; i < error.size() / 3; ++i) {
      if (!(beauty.at(4 * i + 3) > 0.01F)) {
        continue;
      }
      ++covered;
      for (size_t c = 0; c < 3; ++c) {
        const double off = error[3 * i + c];
        mse += off * off;
        bias += off;
        reference += static_cast<double>(beauty[4 * i + c]) - off;
        max = std::max(max, std::abs(off));
      }
    }
    const double count = 3.0 * static_cast<double>(covered);
    mse /= count;
    bias /= count;
    relative_rmse = std::sqrt(mse) / (reference / count);
  }
};

}  // namespace halflight::loopback
