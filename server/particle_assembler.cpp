#include "server/particle_assembler.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "halflight/particle_payload.h"
#include "server/convert/field_checks.h"
#include "server/error_detail.h"

namespace halflight {
namespace {

const AttributeFormat* FindFormat(int attribute) {
  const auto* const found =
      std::find_if(kAttributeFormats.begin(), kAttributeFormats.end(),
                   [attribute](const AttributeFormat& f) { return f.attribute == attribute; });
  return found == kAttributeFormats.end() ? nullptr : found;
}

// The values that an attribute may have.
Interval AllowedValues(v1::ParticleAttribute attribute) {
  switch (attribute) {
    case v1::PARTICLE_ATTRIBUTE_RADIUS:
      return kRadius;
    case v1::PARTICLE_ATTRIBUTE_OPACITY:
      return {.low = 0.0, .high = 1.0};
    case v1::PARTICLE_ATTRIBUTE_COLOR:
    case v1::PARTICLE_ATTRIBUTE_EMISSION:
      return kNotNegative;
    default:
      return kOffset;
  }
}

// Doubles the capacity like push_back does, but never beyond what the whole array needs.
template <typename T>
char* GrowTo(std::vector<T>& values, uint64_t size, uint64_t count) {
  if (size > values.capacity()) {
    values.reserve(std::min<uint64_t>(count, std::max<uint64_t>(size, 2 * values.capacity())));
  }
  values.resize(size);
  return reinterpret_cast<char*>(values.data());
}

template <typename T>
uint64_t CapacityBytes(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

}  // namespace

absl::StatusOr<uint64_t> CheckedPayloadBytes(const v1::ParticleLayout& layout,
                                             const std::string& field, const ServerLimits& limits) {
  FieldChecks checks;
  uint32_t seen = 0;
  for (int i = 0; i < layout.attributes_size() && checks.ok(); ++i) {
    const int attribute = layout.attributes(i);
    const std::string name = fmt::format("{}.attributes[{}]", field, i);
    if (FindFormat(attribute) == nullptr) {
      checks.Reject(name, fmt::format("{}", attribute),
                    "PARTICLE_ATTRIBUTE_POSITION (1) to PARTICLE_ATTRIBUTE_EMISSION (6)");
      continue;
    }
    const uint32_t bit = 1U << static_cast<uint32_t>(attribute);
    if ((seen & bit) != 0) {
      checks.Reject(name, v1::ParticleAttribute_Name(attribute), "each attribute once");
    }
    seen |= bit;
  }
  if (!HasAttribute(layout, v1::PARTICLE_ATTRIBUTE_POSITION)) {
    checks.Reject(field + ".attributes", "no PARTICLE_ATTRIBUTE_POSITION",
                  "a list with PARTICLE_ATTRIBUTE_POSITION");
  }
  checks.InRange(field + ".origin.x", layout.origin().x(), kOffset);
  checks.InRange(field + ".origin.y", layout.origin().y(), kOffset);
  checks.InRange(field + ".origin.z", layout.origin().z(), kOffset);
  if (!checks.ok()) {
    return checks.status();
  }
  const std::optional<uint64_t> bytes = PayloadBytes(layout);
  if (layout.count() > limits.max_particles) {
    return LimitError(field + ".count", fmt::format("{}", layout.count()),
                      fmt::format("at most {} particles", limits.max_particles));
  }
  if (!bytes.has_value() || *bytes > limits.max_particle_bytes) {
    return LimitError(field + ".count",
                      fmt::format("{} particles of these attributes take {} bytes", layout.count(),
                                  bytes.value_or(UINT64_MAX)),
                      fmt::format("at most {}", limits.max_particle_bytes));
  }
  return *bytes;
}

ParticleAssembler::ParticleAssembler(const v1::ParticleLayout& layout, uint64_t payload_bytes)
    : count_(layout.count()), payload_bytes_(payload_bytes), digest_(BeginParticleDigest(layout)) {
  set_->origin = {layout.origin().x(), layout.origin().y(), layout.origin().z()};
  for (const AttributeFormat& format : kAttributeFormats) {
    if (!HasAttribute(layout, format.attribute)) {
      continue;
    }
    Target target{.attribute = format.attribute, .name = format.name, .floats = format.floats};
    switch (format.attribute) {
      case v1::PARTICLE_ATTRIBUTE_POSITION:
        target.vectors = &set_->positions;
        break;
      case v1::PARTICLE_ATTRIBUTE_RADIUS:
        target.scalars = &set_->radii;
        break;
      case v1::PARTICLE_ATTRIBUTE_OPACITY:
        target.scalars = &set_->opacities;
        break;
      case v1::PARTICLE_ATTRIBUTE_COLOR:
        target.vectors = &set_->colors;
        break;
      case v1::PARTICLE_ATTRIBUTE_VELOCITY:
        target.vectors = &set_->velocities;
        break;
      default:
        target.vectors = &set_->emissions;
        break;
    }
    targets_.push_back(target);
  }
}

// Makes room for the next bytes of an array and says where they go.
char* ParticleAssembler::Room(Target& target, uint64_t bytes) const {
  const uint64_t element = target.floats * sizeof(float);
  const uint64_t size = (target.filled + bytes + element - 1) / element;
  char* const data = target.scalars != nullptr ? GrowTo(*target.scalars, size, count_)
                                               : GrowTo(*target.vectors, size, count_);
  return data + target.filled;
}

absl::Status ParticleAssembler::Append(std::string_view bytes) {
  if (bytes.size() > payload_bytes_ - received_) {
    return FieldError("payload", fmt::format("{} bytes or more", received_ + bytes.size()),
                      fmt::format("{} bytes, as the layout asks for", payload_bytes_));
  }
  digest_.Update(bytes);
  received_ += bytes.size();
  while (!bytes.empty()) {
    Target& target = targets_[current_];
    const uint64_t whole = count_ * target.floats * sizeof(float);
    const auto part = bytes.substr(0, whole - target.filled);
    std::memcpy(Room(target, part.size()), part.data(), part.size());
    target.filled += part.size();
    if (absl::Status status = CheckNewValues(target); !status.ok()) {
      return status;
    }
    bytes.remove_prefix(part.size());
    if (target.filled == whole) {
      ++current_;
    }
  }
  return absl::OkStatus();
}

absl::Status ParticleAssembler::CheckNewValues(Target& target) const {
  const Interval allowed = AllowedValues(target.attribute);
  const float* const values = target.scalars != nullptr
                                  ? target.scalars->data()
                                  : reinterpret_cast<const float*>(target.vectors->data());
  const uint64_t complete = target.filled / (target.floats * sizeof(float));
  for (uint64_t i = target.checked * target.floats; i < complete * target.floats; ++i) {
    if (!allowed.Contains(values[i])) {
      constexpr const char* kComponents[] = {".x", ".y", ".z"};
      constexpr const char* kChannels[] = {".r", ".g", ".b"};
      const bool is_color = target.attribute == v1::PARTICLE_ATTRIBUTE_COLOR ||
                            target.attribute == v1::PARTICLE_ATTRIBUTE_EMISSION;
      const uint64_t component = i % target.floats;
      const char* suffix = is_color ? kChannels[component] : kComponents[component];
      return FieldError(
          fmt::format("{}[{}]{}", target.name, i / target.floats, target.floats > 1 ? suffix : ""),
          fmt::format("{}", values[i]), allowed.ToString());
    }
  }
  target.checked = complete;
  return absl::OkStatus();
}

uint64_t ParticleAssembler::capacity_bytes() const {
  return CapacityBytes(set_->positions) + CapacityBytes(set_->radii) +
         CapacityBytes(set_->opacities) + CapacityBytes(set_->colors) +
         CapacityBytes(set_->velocities) + CapacityBytes(set_->emissions);
}

NamedParticles ParticleAssembler::Finish() {
  return {digest_.Finish(), std::shared_ptr<const ParticleSet>(std::move(set_))};
}

}  // namespace halflight
