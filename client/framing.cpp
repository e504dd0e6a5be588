#include "client/framing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace halflight::client {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kAzimuthDeg = 35;
constexpr double kElevationDeg = 20;
// Part of the image that particles may fill: 4 % are left free at either side.
constexpr double kFill = 0.92;

double Radians(double degrees) { return degrees * std::numbers::pi / 180; }

Vec3 Plus(const Vec3& a, const Vec3& b, double factor = 1) {
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}
double Dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 Cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
// The zero vector stays what it is.
Vec3 Unit(const Vec3& a) {
  const double length = std::sqrt(Dot(a, a));
  return length > 0 ? Vec3{a[0] / length, a[1] / length, a[2] / length} : a;
}

// A camera's axes in the world.
struct Axes {
  Vec3 right;
  Vec3 up;
  Vec3 forward;
};

Axes AxesOf(const Vec3& forward, const Vec3& wished_up) {
  Vec3 right = Cross(forward, Unit(wished_up));
  if (Dot(right, right) < 1e-12) {  // looking along up: any other axis will do
    right = Cross(forward, std::abs(forward[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0});
  }
  right = Unit(right);
  return {right, Cross(right, forward), forward};
}

// The three-quarter view: from the right of the front, and from above.
Vec3 ThreeQuarterForward(const Vec3& wished_up) {
  const Vec3 up = Unit(wished_up);
  const Vec3 world_front = std::abs(up[2]) > 0.7 ? Vec3{0, -1, 0} : Vec3{0, 0, 1};
  const Vec3 front = Unit(Plus(world_front, up, -Dot(world_front, up)));
  const Vec3 right = Cross(up, front);
  Vec3 from =
      Plus(Vec3{}, front, std::cos(Radians(kAzimuthDeg)) * std::cos(Radians(kElevationDeg)));
  from = Plus(from, right, std::sin(Radians(kAzimuthDeg)) * std::cos(Radians(kElevationDeg)));
  from = Plus(from, up, std::sin(Radians(kElevationDeg)));
  return Unit(Plus(Vec3{}, from, -1));
}

// Calls visit(centre, radius) for each particle of all clouds.
template <typename Visit>
void ForEach(const std::vector<const Particles*>& clouds, double radius, Visit visit) {
  for (const Particles* cloud : clouds) {
    for (size_t i = 0; i < cloud->size(); ++i) {
      const float* p = &cloud->positions[3 * i];
      visit(Plus(cloud->origin, {p[0], p[1], p[2]}),
            cloud->radii.empty() ? radius : cloud->radii[i]);
    }
  }
}

// How far the cloud reaches beyond planes through a pivot that are parallel to one image axis and
// to the sides of the picture: largest of (along the axis, or against it) * cosine - depth * sine
// + radius. For a parallel projection sine is 0.
struct Reach {
  double sine;
  double cosine;
  double along = -kInfinity;
  double against = -kInfinity;

  void Add(double position, double depth, double radius) {
    along = std::max(along, radius + cosine * position - sine * depth);
    against = std::max(against, radius - cosine * position - sine * depth);
  }
  // The eye's place on the axis from which both sides are reached alike.
  [[nodiscard]] double Middle() const { return (along - against) / (2 * cosine); }
  // The largest depth of an eye, standing at `position` on the axis, that sees everything.
  [[nodiscard]] double Depth(double position) const {
    return std::min(cosine * position - along, -cosine * position - against) / sine;
  }
  // Of a parallel projection: half of what has to be seen from `position`.
  [[nodiscard]] double HalfSize(double position) const {
    return std::max(along - position, against + position);
  }
};

double DistanceToNth(const Particles& particles, size_t from, size_t n) {
  std::vector<float> nearest(n, std::numeric_limits<float>::infinity());
  const float* p = particles.positions.data();
  for (size_t i = 0; i < particles.size(); ++i) {
    const float dx = p[3 * i] - p[3 * from];
    const float dy = p[3 * i + 1] - p[3 * from + 1];
    const float dz = p[3 * i + 2] - p[3 * from + 2];
    const float squared = dx * dx + dy * dy + dz * dz;
    if (squared < nearest.front() && i != from) {
      std::pop_heap(nearest.begin(), nearest.end());
      nearest.back() = squared;
      std::push_heap(nearest.begin(), nearest.end());
    }
  }
  return std::sqrt(nearest.front());
}

}  // namespace

Vec3 Bounds::Centre() const {
  return {low[0] / 2 + high[0] / 2, low[1] / 2 + high[1] / 2, low[2] / 2 + high[2] / 2};
}

std::optional<Bounds> BoundsOf(const Particles& particles, double radius) {
  if (particles.size() == 0) {
    return std::nullopt;
  }
  Bounds bounds{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  ForEach({&particles}, radius, [&bounds](const Vec3& centre, double r) {
    for (size_t axis = 0; axis < 3; ++axis) {
      bounds.low[axis] = std::min(bounds.low[axis], centre[axis] - r);
      bounds.high[axis] = std::max(bounds.high[axis], centre[axis] + r);
    }
  });
  return bounds;
}

Bounds Union(const Bounds& a, const Bounds& b) {
  Bounds bounds = a;
  for (size_t axis = 0; axis < 3; ++axis) {
    bounds.low[axis] = std::min(a.low[axis], b.low[axis]);
    bounds.high[axis] = std::max(a.high[axis], b.high[axis]);
  }
  return bounds;
}

double EstimateRadius(const Particles& particles) {
  constexpr size_t kNeighbour = 8;
  constexpr double kFactor = 2.5;
  const size_t count = particles.size();
  if (count < 2) {
    return 1;
  }
  // Every pick is compared with every particle: 2^28 comparisons take about a quarter of a second.
  const size_t picks = std::min(count, std::clamp<size_t>((size_t{1} << 28) / count, 32, 512));
  const size_t neighbour = std::min(kNeighbour, count - 1);
  std::vector<double> distances;
  for (size_t i = 0; i < picks; ++i) {
    distances.push_back(DistanceToNth(particles, i * count / picks, neighbour));
  }
  std::nth_element(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(picks / 2),
                   distances.end());
  const double median = distances[picks / 2];
  if (median > 0) {
    // Of few particles a nearer neighbour is taken: spacing grows with the cube root of its rank.
    return kFactor * median *
           std::cbrt(static_cast<double>(kNeighbour) / static_cast<double>(neighbour));
  }
  const Bounds bounds = *BoundsOf(particles, 0);
  double extent = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    extent = std::max(extent, bounds.high[axis] - bounds.low[axis]);
  }
  return extent > 0 ? extent / 100 : 1;
}

View FrameParticles(const std::vector<const Particles*>& clouds, double radius,
                    const Projection& projection, const ViewWishes& wishes) {
  std::optional<Bounds> bounds;
  for (const Particles* cloud : clouds) {
    if (const auto more = BoundsOf(*cloud, radius)) {
      bounds = bounds ? Union(*bounds, *more) : *more;
    }
  }
  // Without particles any view shows them all: one world unit round the origin will do.
  const Vec3 default_target = wishes.eye && !bounds ? Plus(*wishes.eye, {0, 0, -1})
                              : bounds              ? bounds->Centre()
                                                    : Vec3{};
  Vec3 target = wishes.target.value_or(default_target);
  Vec3 forward = wishes.eye ? Unit(Plus(target, *wishes.eye, -1)) : ThreeQuarterForward(wishes.up);
  if (Dot(forward, forward) == 0) {
    forward = {0, 0, -1};  // the eye is in the middle of the cloud
    target = wishes.target ? target : Plus(*wishes.eye, forward);
  }
  const Axes axes = AxesOf(forward, wishes.up);
  const Vec3 pivot = wishes.eye ? *wishes.eye : target;

  const double tangent =
      projection.orthographic ? 0 : kFill * std::tan(Radians(projection.vertical_fov_deg) / 2);
  const double vertical_angle = std::atan(tangent);
  const double horizontal_angle = std::atan(tangent * projection.aspect);
  Reach horizontal{std::sin(horizontal_angle), std::cos(horizontal_angle)};
  Reach vertical{std::sin(vertical_angle), std::cos(vertical_angle)};
  double nearest = kInfinity;
  auto add = [&](const Vec3& centre, double r) {
    const Vec3 offset = Plus(centre, pivot, -1);
    const double depth = Dot(offset, axes.forward);
    horizontal.Add(Dot(offset, axes.right), depth, r);
    vertical.Add(Dot(offset, axes.up), depth, r);
    nearest = std::min(nearest, depth - r);
  };
  ForEach(clouds, radius, add);
  if (!bounds) {
    add(target, 1);
  }

  // The pivot stays in the middle where the user fixed it, otherwise the cloud does.
  const bool fixed = wishes.eye || wishes.target;
  const double x = fixed ? 0 : horizontal.Middle();
  const double y = fixed ? 0 : vertical.Middle();
  const Vec3 middle = Plus(Plus(pivot, axes.right, x), axes.up, y);
  View view;
  if (projection.orthographic) {
    const double half_height =
        std::max(vertical.HalfSize(y), horizontal.HalfSize(x) / projection.aspect);
    view.orthographic_height = 2 * half_height / kFill;
    const double depth = std::min(nearest, 0.0) - view.orthographic_height;
    view.eye = wishes.eye ? *wishes.eye : Plus(middle, axes.forward, depth);
  } else {
    // A target may lie in front of the cloud: the eye stays on its own side of it.
    const double depth = std::min({horizontal.Depth(x), vertical.Depth(y), -1e-3 * radius});
    view.eye = wishes.eye ? *wishes.eye : Plus(middle, axes.forward, depth);
  }
  view.target = fixed ? target : middle;
  return view;
}

Vec3 SideLight(const View& view, const Vec3& up) {
  const Axes axes = AxesOf(Unit(Plus(view.target, view.eye, -1)), up);
  Vec3 from = Plus(Vec3{}, axes.right, -0.75);
  from = Plus(from, axes.up, 0.6);
  from = Plus(from, axes.forward, -0.28);
  return Unit(Plus(Vec3{}, from, -1));
}

}  // namespace halflight::client
