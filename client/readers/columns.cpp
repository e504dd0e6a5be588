#include "client/readers/columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>

#include "absl/strings/ascii.h"
#include "client/readers/text.h"
#include "halflight/particle_payload.h"

namespace halflight::client {

namespace {

// Ways in which files name an attribute's components; the first way that a file has counts.
struct Naming {
  Attribute attribute;
  std::vector<const char*> components;
};

const std::vector<Naming>& Namings() {
  static const auto* const namings = new std::vector<Naming>{
      {Attribute::kPosition, {"x", "y", "z"}},
      {Attribute::kColor, {"red", "green", "blue"}},
      {Attribute::kColor, {"r", "g", "b"}},
      {Attribute::kColor, {"color_r", "color_g", "color_b"}},
      {Attribute::kVelocity, {"vx", "vy", "vz"}},
      {Attribute::kVelocity, {"velocity_x", "velocity_y", "velocity_z"}},
      {Attribute::kEmission, {"emission_r", "emission_g", "emission_b"}},
      {Attribute::kEmission, {"emission_red", "emission_green", "emission_blue"}},
      {Attribute::kRadius, {"radius"}},
      {Attribute::kRadius, {"pscale"}},
      {Attribute::kRadius, {"r"}},
      {Attribute::kOpacity, {"opacity"}},
      {Attribute::kOpacity, {"alpha"}},
  };
  return *namings;
}

std::string Quoted(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += fmt::format("{}'{}'", text.empty() ? "" : ", ", Excerpt(name));
  }
  return text.empty() ? "none" : text;
}

std::optional<size_t> Find(const std::vector<std::string>& names, std::string_view wanted) {
  for (size_t i = 0; i < names.size(); ++i) {
    if (absl::AsciiStrToLower(names[i]) == wanted) {
      return i;
    }
  }
  return std::nullopt;
}

// What a value of an attribute has to be, in words; null where `value` is that.
const char* WhatIsAllowed(Attribute attribute, float value) {
  switch (attribute) {
    case Attribute::kRadius:
      return value >= kSmallestRadius && value <= kLargestLength ? nullptr : "in [1e-15, 1e17]";
    case Attribute::kOpacity:
      return value >= 0 && value <= 1 ? nullptr : "in [0, 1]";
    case Attribute::kColor:
    case Attribute::kEmission:
      return std::isfinite(value) && value >= 0 ? nullptr : "finite and >= 0";
    default:
      return std::abs(value) <= kLargestLength ? nullptr : "in [-1e17, 1e17]";
  }
}

const char* NameOf(Attribute attribute) {
  constexpr std::array<const char*, kAttributes> kNames = {"position", "radius",   "opacity",
                                                           "color",    "velocity", "emission"};
  return kNames[static_cast<size_t>(attribute)];
}

absl::Status BadValue(size_t particle, Attribute attribute, size_t component, double value,
                      const char* allowed) {
  std::string name = NameOf(attribute);
  if (Columns::Components(attribute) == 3) {
    const bool is_color = attribute == Attribute::kColor || attribute == Attribute::kEmission;
    name += fmt::format(".{}", (is_color ? "rgb" : "xyz")[component]);
  }
  return absl::InvalidArgumentError(fmt::format(
      "particle {} (counted from 0): {} is {}; allowed: {}", particle, name, value, allowed));
}

// An origin along one axis for coordinates in [low, high]; `extent` is the cloud's largest side.
double ChooseOrigin(double low, double high, double extent) {
  const double centre = low / 2 + high / 2;
  if (extent == 0) {
    return centre;
  }
  const double step = std::exp2(std::floor(std::log2(extent)));
  return std::clamp(std::nearbyint(centre / step) * step, -kLargestLength, kLargestLength);
}

}  // namespace

absl::StatusOr<std::vector<std::optional<Column>>> MatchColumns(
    const std::vector<std::string>& names) {
  std::vector<std::optional<Column>> columns(names.size());
  std::array<bool, kAttributes> found{};
  for (const Naming& naming : Namings()) {
    std::vector<size_t> at;
    std::string missing;
    for (const char* component : naming.components) {
      if (const auto index = Find(names, component); index && !columns[*index]) {
        at.push_back(*index);
      } else {
        missing += fmt::format("{}'{}'", missing.empty() ? "" : ", ", component);
      }
    }
    bool& have = found[static_cast<size_t>(naming.attribute)];
    const bool required = naming.attribute == Attribute::kPosition;
    if (at.size() == naming.components.size() && !have) {
      for (size_t i = 0; i < at.size(); ++i) {
        columns[at[i]] = Column{naming.attribute, i};
      }
      have = true;
      continue;
    }
    // A lone r, g or b may be anything, such as a radius; two of them are a colour cut short.
    const size_t partial = std::string_view(naming.components[0]) == "r" ? 2 : 1;
    if (required || (!have && !missing.empty() && at.size() >= partial)) {
      return absl::InvalidArgumentError(
          fmt::format("{} needs {}; missing: {}; found: {}", NameOf(naming.attribute),
                      fmt::join(naming.components, ", "), missing, Quoted(names)));
    }
  }
  return columns;
}

void Columns::Resize(size_t count, const std::vector<std::optional<Column>>& columns) {
  positions.resize(3 * count);
  for (const std::optional<Column>& column : columns) {
    if (column && column->attribute != Attribute::kPosition) {
      others[static_cast<size_t>(column->attribute)].resize(count * Components(column->attribute));
    }
  }
}

absl::StatusOr<Particles> ParticlesFromColumns(Columns columns) {
  // Check the values and find the bounds of the centres.
  std::array<double, 3> low;
  std::array<double, 3> high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < columns.positions.size(); ++i) {
    const double value = columns.positions[i];
    if (!(std::abs(value) <= kLargestLength)) {
      return BadValue(i / 3, Attribute::kPosition, i % 3, value, "in [-1e17, 1e17]");
    }
    low[i % 3] = std::min(low[i % 3], value);
    high[i % 3] = std::max(high[i % 3], value);
  }
  for (size_t a = 1; a < kAttributes; ++a) {
    const auto attribute = static_cast<Attribute>(a);
    const size_t components = Columns::Components(attribute);
    for (size_t i = 0; i < columns.others[a].size(); ++i) {
      const float value = columns.others[a][i];
      if (const char* allowed = WhatIsAllowed(attribute, value)) {
        return BadValue(i / components, attribute, i % components, value, allowed);
      }
    }
  }

  // Choose the origin: below 8 extents, offsets from the world's origin lose three bits at most.
  Particles particles;
  double extent = 0;
  double largest = 0;
  if (!columns.positions.empty()) {
    for (size_t axis = 0; axis < 3; ++axis) {
      extent = std::max(extent, high[axis] - low[axis]);
      largest = std::max({largest, std::abs(low[axis]), std::abs(high[axis])});
    }
  }
  if (largest > 8 * extent) {
    for (size_t axis = 0; axis < 3; ++axis) {
      particles.origin[axis] = ChooseOrigin(low[axis], high[axis], extent);
    }
  }

  particles.positions.resize(columns.positions.size());
  for (size_t i = 0; i < columns.positions.size(); ++i) {
    const double offset = columns.positions[i] - particles.origin[i % 3];
    particles.positions[i] = static_cast<float>(offset);
  }
  auto take = [&columns](Attribute attribute) {
    return std::move(columns.others[static_cast<size_t>(attribute)]);
  };
  particles.radii = take(Attribute::kRadius);
  particles.opacities = take(Attribute::kOpacity);
  particles.colors = take(Attribute::kColor);
  particles.velocities = take(Attribute::kVelocity);
  particles.emissions = take(Attribute::kEmission);
  return particles;
}

}  // namespace halflight::client
