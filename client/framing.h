// Chooses what a request leaves open: a radius, a camera that shows the whole cloud, a light.
// Knows nothing of requests; positions are float64 world coordinates.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "client/particles.h"

namespace halflight::client {

using Vec3 = std::array<double, 3>;

// A box round all particles, their radii included.
struct Bounds {
  Vec3 low;
  Vec3 high;

  [[nodiscard]] Vec3 Centre() const;
};

// None for no particles. `radius` serves where the particles have none.
std::optional<Bounds> BoundsOf(const Particles& particles, double radius);
Bounds Union(const Bounds& a, const Bounds& b);

// A radius with which neighbours overlap enough to look like smoke rather than dots: 2.5 times the
// median distance to the eighth nearest neighbour, over up to 512 particles evenly picked. The
// factor gives the plume of the tests, whose authors like 0.045, that radius. Where neighbours
// coincide: a hundredth of the extent; 1 where there is no extent either, or no particle.
double EstimateRadius(const Particles& particles);

// How the image projects: a field of view, or the world height of an orthographic image.
struct Projection {
  double aspect = 4.0 / 3.0;     // width / height
  double vertical_fov_deg = 40;  // perspective
  bool orthographic = false;     // the height is then chosen with the eye
};

struct View {
  Vec3 eye;
  Vec3 target;
  double orthographic_height = 0;
};

// What the user fixed of the view.
struct ViewWishes {
  std::optional<Vec3> eye;
  std::optional<Vec3> target;
  Vec3 up = {0, 1, 0};
};

// A view that shows every particle, with a margin of 4 % of the image at the sides that fit
// tightest. Where the user fixed nothing it looks from 35 degrees to the right of the front (+z, or
// -y where z is up) and 20 degrees above. A fixed target stays in the middle; with a fixed eye the
// view is towards the target, or the middle of the bounds. `clouds` are framed together.
View FrameParticles(const std::vector<const Particles*>& clouds, double radius,
                    const Projection& projection, const ViewWishes& wishes);

// The direction in which a light travels that comes from the left of the view, from above and a
// little from the front, so that the side in shadow is seen. Unit length.
Vec3 SideLight(const View& view, const Vec3& up);

}  // namespace halflight::client
