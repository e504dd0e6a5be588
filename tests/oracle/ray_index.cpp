// Enters each particle into every cell whose rays may meet it; see ray_index.h.
#include "tests/oracle/ray_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace halflight::oracle {
namespace {

constexpr int kMostCellsAcross = 1024;  // of a plane
constexpr int kMostCellsOfFace = 256;   // a power of two

struct CubePlace {
  int face;  // 0 to 5: +x, -x, +y, -y, +z, -z
  double u;  // [-1, 1]
  double v;
};

CubePlace PlaceOnCube(const glm::dvec3& d) {
  const glm::dvec3 size = glm::abs(d);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const int next = (axis + 1) % 3;
  const int last = (axis + 2) % 3;
  const double scale = size[axis] > 0.0 ? 1.0 / size[axis] : 0.0;
  return {2 * axis + (d[axis] < 0.0 ? 1 : 0), d[next] * scale, d[last] * scale};
}

glm::dvec3 DirectionOnCube(const CubePlace& place) {
  const int axis = place.face / 2;
  glm::dvec3 d(0.0);
  d[axis] = place.face % 2 == 0 ? 1.0 : -1.0;
  d[(axis + 1) % 3] = place.u;
  d[(axis + 2) % 3] = place.v;
  return glm::normalize(d);
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The cone round a particle, as seen from the rays' common point.
struct Cone {
  glm::dvec3 direction;
  double half_angle;
};

Cone ConeRound(const Particle& particle, const glm::dvec3& point) {
  const glm::dvec3 offset = particle.center - point;
  const double distance = glm::length(offset);
  if (distance <= particle.radius) return {{0.0, 0.0, 1.0}, std::numbers::pi};
  return {offset / distance, std::asin(particle.radius / distance)};
}

// Walks down the quarters of a face that the cone may touch, to the cells.
template <typename Enter>
void VisitCells(const Cone& cone, int face, double u, double v, double half_width, double cell_half,
                const Enter& enter) {
  // Angles seen from the centre are never larger than distances on the face.
  const double reach = cone.half_angle + std::sqrt(2.0) * half_width + 1e-9;
  const double cosine = glm::dot(DirectionOnCube({face, u, v}), cone.direction);
  if (reach < std::numbers::pi && cosine < std::cos(reach)) return;
  if (half_width <= cell_half * 1.5) {
    enter(u, v);
    return;
  }
  const double quarter = half_width / 2.0;
  for (const double du : {-quarter, quarter}) {
    for (const double dv : {-quarter, quarter}) {
      VisitCells(cone, face, u + du, v + dv, quarter, cell_half, enter);
    }
  }
}

}  // namespace

glm::dvec3 Rays::DirectionAt(const glm::dvec3& x) const {
  return parallel_ ? vector_ : glm::normalize(x - vector_);
}

double Rays::DepthOf(const glm::dvec3& x) const {
  return parallel_ ? glm::dot(x, vector_) : glm::distance(x, vector_);
}

RayIndex::RayIndex(const Rays& rays, const Cloud& cloud, std::span<const uint32_t> order)
    : rays_(rays) {
  std::vector<Entry> entries;
  if (!order.empty()) {
    if (rays_.parallel()) {
      EnterParallel(cloud, order, entries);
    } else {
      EnterCube(cloud, order, entries);
    }
  }
  // Counting sort by cell; entries come by ascending rank, and stay so within a cell.
  const size_t cells =
      static_cast<size_t>(columns_) * static_cast<size_t>(rows_) * (rays_.parallel() ? 1U : 6U);
  first_.assign(cells + 1, 0);
  for (const Entry& entry : entries) ++first_[entry.cell + 1];
  for (size_t cell = 0; cell < cells; ++cell) first_[cell + 1] += first_[cell];
  ranks_.resize(entries.size());
  std::vector<uint32_t> next(first_.begin(), first_.end());
  for (const Entry& entry : entries) ranks_[next[entry.cell]++] = entry.rank;
}

void RayIndex::EnterParallel(const Cloud& cloud, std::span<const uint32_t> order,
                             std::vector<Entry>& entries) {
  const glm::dvec3& direction = rays_.vector();
  const glm::dvec3 helper =
      std::abs(direction.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  axis_u_ = glm::normalize(glm::cross(direction, helper));
  axis_v_ = glm::cross(direction, axis_u_);
  low_u_ = low_v_ = std::numeric_limits<double>::infinity();
  double high_u = -low_u_;
  double high_v = -low_v_;
  std::vector<double> radii;
  for (const uint32_t index : order) {
    const Particle& particle = cloud.particles[index];
    const double u = glm::dot(particle.center, axis_u_);
    const double v = glm::dot(particle.center, axis_v_);
    low_u_ = std::min(low_u_, u - particle.radius);
    low_v_ = std::min(low_v_, v - particle.radius);
    high_u = std::max(high_u, u + particle.radius);
    high_v = std::max(high_v, v + particle.radius);
    radii.push_back(particle.radius);
  }
  const double extent = std::max(high_u - low_u_, high_v - low_v_);
  cell_size_ = std::max(Median(std::move(radii)) / 2.0, extent / kMostCellsAcross);
  columns_ = static_cast<int>((high_u - low_u_) / cell_size_) + 1;
  rows_ = static_cast<int>((high_v - low_v_) / cell_size_) + 1;

  for (size_t rank = 0; rank < order.size(); ++rank) {
    const Particle& particle = cloud.particles[order[rank]];
    const double u = (glm::dot(particle.center, axis_u_) - low_u_) / cell_size_;
    const double v = (glm::dot(particle.center, axis_v_) - low_v_) / cell_size_;
    const double radius = particle.radius / cell_size_ * (1.0 + 1e-9) + 1e-9;
    const auto clamp_to = [](double cell, int count) {
      return std::clamp(static_cast<int>(std::floor(cell)), 0, count - 1);
    };
    for (int row = clamp_to(v - radius, rows_); row <= clamp_to(v + radius, rows_); ++row) {
      for (int column = clamp_to(u - radius, columns_); column <= clamp_to(u + radius, columns_);
           ++column) {
        const double du = std::clamp(u, column * 1.0, column + 1.0) - u;
        const double dv = std::clamp(v, row * 1.0, row + 1.0) - v;
        if (du * du + dv * dv > radius * radius) continue;
        entries.push_back(
            {static_cast<uint32_t>(row * columns_ + column), static_cast<uint32_t>(rank)});
      }
    }
  }
}

void RayIndex::EnterCube(const Cloud& cloud, std::span<const uint32_t> order,
                         std::vector<Entry>& entries) {
  std::vector<double> angles;
  for (const uint32_t index : order) {
    angles.push_back(ConeRound(cloud.particles[index], rays_.vector()).half_angle);
  }
  const double wanted_half = std::max(Median(std::move(angles)) / 4.0, 1.0 / kMostCellsOfFace);
  columns_ = 1;
  while (1.0 / columns_ > wanted_half && columns_ < kMostCellsOfFace) columns_ *= 2;
  rows_ = columns_;
  const double cell_half = 1.0 / columns_;
  for (size_t rank = 0; rank < order.size(); ++rank) {
    const Cone cone = ConeRound(cloud.particles[order[rank]], rays_.vector());
    for (int face = 0; face < 6; ++face) {
      VisitCells(cone, face, 0.0, 0.0, 1.0, cell_half, [&](double u, double v) {
        const auto column = static_cast<int>((u + 1.0) / 2.0 * columns_);
        const auto row = static_cast<int>((v + 1.0) / 2.0 * rows_);
        entries.push_back({static_cast<uint32_t>((face * rows_ + row) * columns_ + column),
                           static_cast<uint32_t>(rank)});
      });
    }
  }
}

int64_t RayIndex::CellOf(const glm::dvec3& x) const {
  if (columns_ == 0) return -1;
  if (rays_.parallel()) {
    const double column = std::floor((glm::dot(x, axis_u_) - low_u_) / cell_size_);
    const double row = std::floor((glm::dot(x, axis_v_) - low_v_) / cell_size_);
    if (column < 0.0 || row < 0.0 || column >= columns_ || row >= rows_) return -1;
    return static_cast<int64_t>(row) * columns_ + static_cast<int64_t>(column);
  }
  const CubePlace place = PlaceOnCube(x - rays_.vector());
  const auto cell = [this](double along) {
    return std::clamp(static_cast<int>((along + 1.0) / 2.0 * columns_), 0, columns_ - 1);
  };
  return (static_cast<int64_t>(place.face) * rows_ + cell(place.v)) * columns_ + cell(place.u);
}

std::span<const uint32_t> RayIndex::Candidates(const glm::dvec3& x) const {
  const int64_t cell = CellOf(x);
  if (cell < 0) return {};
  const size_t begin = first_[static_cast<size_t>(cell)];
  const size_t end = first_[static_cast<size_t>(cell) + 1];
  return std::span(ranks_).subspan(begin, end - begin);
}

}  // namespace halflight::oracle
