// What the readers have in common: the columns that a file's values go into, how columns are named,
// and how columns become particles. Knows no file format.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/particles.h"

namespace halflight::client {

enum class Attribute : unsigned char {
  kPosition,
  kRadius,
  kOpacity,
  kColor,
  kVelocity,
  kEmission,
};
inline constexpr size_t kAttributes = 6;

// Where a named column of a file goes.
struct Column {
  Attribute attribute = Attribute::kPosition;
  size_t component = 0;
};

// For each of a file's column names, where its values go; none for columns that mean nothing here.
// A name that stands for the same thing as a better known one beside it is passed over (pscale
// beside radius). InvalidArgument where x, y or z is missing, or part of another triple is.
// Names known, in any case:
//   position  x y z                 colour    red green blue, r g b, color_r ..
//   velocity  vx vy vz, velocity_x ..   emission  emission_r .., emission_red ..
//   radius    radius, pscale, r (where g and b are not)      opacity  opacity, alpha
absl::StatusOr<std::vector<std::optional<Column>>> MatchColumns(
    const std::vector<std::string>& names);

// Values as they are in a file, in the order of the particles.
struct Columns {
  // x, y, z in float64, so that large coordinates survive until their origin is chosen.
  std::vector<double> positions;
  // The rest, indexed by Attribute; [kPosition] stays empty.
  std::array<std::vector<float>, kAttributes> others;

  void Resize(size_t count, const std::vector<std::optional<Column>>& columns);
  void Set(size_t particle, Column column, double value) {
    if (column.attribute == Attribute::kPosition) {
      positions[3 * particle + column.component] = value;
    } else {
      const auto index = static_cast<size_t>(column.attribute);
      others[index][particle * Components(column.attribute) + column.component] =
          static_cast<float>(value);
    }
  }
  static size_t Components(Attribute attribute) {
    return attribute == Attribute::kRadius || attribute == Attribute::kOpacity ? 1 : 3;
  }
};

// Checks every value (InvalidArgument names attribute and particle) and chooses the origin: (0, 0,
// 0), unless coordinates are so large against the cloud's extent that 32-bit offsets would lose
// accuracy; then a point near its centre, rounded so that subtracting it is exact for coordinates
// that are accurate to 2^-24 of the extent or coarser.
absl::StatusOr<Particles> ParticlesFromColumns(Columns columns);

}  // namespace halflight::client
