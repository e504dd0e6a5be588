// Finds collisions by delta tracking with a majorant for each cell; see particle_medium.h.
#include "tests/monte_carlo/particle_medium.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace halflight::monte_carlo {
namespace {

// Cells of half a radius have few particles that lie beside the point looked up.
constexpr double kCellsPerRadius = 2.0;
constexpr double kMostCells = 1e7;

// The part of a ray within a box, as distances; empty where the second is not above the first.
std::pair<double, double> Within(const glm::dvec3& low, const glm::dvec3& high,
                                 const Photon& photon) {
  double enter = 0.0;
  double leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double slope = photon.direction[axis];
    const double from = low[axis] - photon.position[axis];
    const double to = high[axis] - photon.position[axis];
    if (slope == 0.0) {
      if (from > 0.0 || to < 0.0) return {0.0, 0.0};
      continue;
    }
    enter = std::max(enter, std::min(from / slope, to / slope));
    leave = std::min(leave, std::max(from / slope, to / slope));
  }
  return {enter, leave};
}

}  // namespace

double Extinction(const reference::Particle& particle, Profile profile, double squared_distance) {
  const double inside = 1.0 - squared_distance / (particle.radius * particle.radius);
  if (inside <= 0.0) return 0.0;
  return profile == Profile::kBall ? particle.optical_depth / (2.0 * particle.radius)
                                   : 2.0 * particle.optical_depth /
                                         (std::numbers::pi * particle.radius) * std::sqrt(inside);
}

double CrossSection(const reference::Particle& particle, Profile profile) {
  const double share = profile == Profile::kBall ? 2.0 / 3.0 : 1.0 / 2.0;
  return share * std::numbers::pi * particle.radius * particle.radius * particle.optical_depth;
}

ParticleMedium::ParticleMedium(const reference::Cloud& cloud, double density)
    : cloud_(cloud), density_(density) {
  low_ = glm::dvec3(std::numeric_limits<double>::infinity());
  high_ = -low_;
  double radii = 0.0;
  for (const reference::Particle& particle : cloud.particles) {
    low_ = glm::min(low_, particle.center - particle.radius);
    high_ = glm::max(high_, particle.center + particle.radius);
    radii += particle.radius;
  }
  const glm::dvec3 extent = high_ - low_;
  cell_size_ = std::max(radii / (kCellsPerRadius * static_cast<double>(cloud.particles.size())),
                        std::cbrt(extent.x * extent.y * extent.z / kMostCells));
  cells_ = glm::ivec3(glm::floor(extent / cell_size_)) + 1;

  // Count, then place.
  const size_t cells = CellAt(cells_ - 1) + 1;
  begin_.resize(cells + 1);
  majorant_.resize(cells);
  for (const reference::Particle& particle : cloud.particles) {
    VisitCells(particle, [&](size_t cell, double nearest_squared) {
      ++begin_[cell + 1];
      majorant_[cell] += density_ * Extinction(particle, cloud.profile, nearest_squared);
    });
  }
  for (size_t cell = 0; cell < cells; ++cell) begin_[cell + 1] += begin_[cell];
  particles_.resize(begin_.back());
  std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (uint32_t i = 0; i < cloud.particles.size(); ++i) {
    VisitCells(cloud.particles[i],
               [&](size_t cell, double /*nearest*/) { particles_[next[cell]++] = i; });
  }
}

// Calls for each cell that the particle reaches, with the squared distance of its nearest point.
template <typename Visit>
void ParticleMedium::VisitCells(const reference::Particle& particle, const Visit& visit) const {
  const auto cell_of = [&](const glm::dvec3& place) {
    return glm::clamp(glm::ivec3(glm::floor((place - low_) / cell_size_)), glm::ivec3(0),
                      cells_ - 1);
  };
  const glm::ivec3 first = cell_of(particle.center - particle.radius);
  const glm::ivec3 last = cell_of(particle.center + particle.radius);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        const glm::dvec3 corner = low_ + cell_size_ * glm::dvec3(x, y, z);
        const glm::dvec3 nearest = glm::clamp(particle.center, corner, corner + cell_size_);
        const glm::dvec3 offset = nearest - particle.center;
        const double squared = glm::dot(offset, offset);
        if (squared < particle.radius * particle.radius) visit(CellAt({x, y, z}), squared);
      }
    }
  }
}

void ParticleMedium::Meet(size_t cell, Flight& flight) const {
  flight.particles.clear();
  flight.extinction = 0.0;
  flight.majorant = majorant_[cell];
  for (uint32_t k = begin_[cell]; k < begin_[cell + 1]; ++k) {
    const reference::Particle& particle = cloud_.particles[particles_[k]];
    const glm::dvec3 offset = flight.end - particle.center;
    const double extinction =
        density_ * Extinction(particle, cloud_.profile, glm::dot(offset, offset));
    if (extinction > 0.0) {
      flight.particles.push_back({particles_[k], extinction});
      flight.extinction += extinction;
    }
  }
}

bool ParticleMedium::Fly(const Photon& photon, Random& random, Flight& flight) const {
  flight.particles.clear();
  const auto [enter, leave] = Within(low_, high_, photon);
  if (!(leave > enter)) return false;

  // From cell to cell (Amanatides and Woo 1987) until the depth of the flight is used up.
  double left = random.Exponential();
  double at = enter;
  const glm::dvec3 start = (photon.position + at * photon.direction - low_) / cell_size_;
  glm::ivec3 cell = glm::clamp(glm::ivec3(glm::floor(start)), glm::ivec3(0), cells_ - 1);
  glm::ivec3 step(0);
  glm::dvec3 next(std::numeric_limits<double>::infinity());  // distances to the next walls
  glm::dvec3 between = next;
  for (int axis = 0; axis < 3; ++axis) {
    const double slope = photon.direction[axis];
    if (slope == 0.0) continue;
    step[axis] = slope > 0.0 ? 1 : -1;
    const double wall = low_[axis] + cell_size_ * (cell[axis] + (slope > 0.0 ? 1 : 0));
    next[axis] = (wall - photon.position[axis]) / slope;
    between[axis] = cell_size_ / std::abs(slope);
  }
  for (;;) {
    const int axis = next.x <= next.y ? (next.x <= next.z ? 0 : 2) : (next.y <= next.z ? 1 : 2);
    const size_t here = CellAt(cell);
    const double length = std::max(std::min(next[axis], leave) - at, 0.0);
    const double depth = length * majorant_[here];
    if (left < depth) {
      flight.end = photon.position + (at + left / majorant_[here]) * photon.direction;
      Meet(here, flight);
      return true;
    }
    left -= depth;
    at += length;
    cell[axis] += step[axis];
    if (next[axis] >= leave || cell[axis] < 0 || cell[axis] >= cells_[axis]) return false;
    next[axis] += between[axis];
  }
}

}  // namespace halflight::monte_carlo
