// Builds a particle set from its payload as the bytes arrive: names it, checks its values, and
// takes no more memory than what has arrived needs. Knows nothing of streams or of the store.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "halflight/sha256.h"
#include "halflight/v1/particles.pb.h"
#include "renderer/scene.h"
#include "server/limits.h"

namespace halflight {

// A particle set with its name.
struct NamedParticles {
  std::string sha256;
  std::shared_ptr<const ParticleSet> set;
};

// Whether a layout is one that the server takes, and how many bytes of payload it asks for. Errors
// start with `field`, the layout's path.
absl::StatusOr<uint64_t> CheckedPayloadBytes(const v1::ParticleLayout& layout,
                                             const std::string& field, const ServerLimits& limits);

class ParticleAssembler {
 public:
  // The layout has passed CheckedPayloadBytes.
  ParticleAssembler(const v1::ParticleLayout& layout, uint64_t payload_bytes);

  // The next bytes of the payload, cut anywhere. InvalidArgument for more bytes than the layout
  // asks for, and for a value that is out of range, named by attribute and index.
  absl::Status Append(std::string_view bytes);

  [[nodiscard]] uint64_t received_bytes() const { return received_; }
  [[nodiscard]] uint64_t payload_bytes() const { return payload_bytes_; }
  // Memory held for values that have arrived, and for those about to.
  [[nodiscard]] uint64_t capacity_bytes() const;

  // Valid once, after all of the payload.
  NamedParticles Finish();

 private:
  // One array of the payload, in the set.
  struct Target {
    v1::ParticleAttribute attribute;
    const char* name;
    uint32_t floats;                        // a particle
    std::vector<float>* scalars = nullptr;  // one of the two
    std::vector<glm::vec3>* vectors = nullptr;
    uint64_t filled = 0;   // bytes
    uint64_t checked = 0;  // particles
  };

  char* Room(Target& target, uint64_t bytes) const;
  absl::Status CheckNewValues(Target& target) const;

  std::unique_ptr<ParticleSet> set_ = std::make_unique<ParticleSet>();
  uint64_t count_;
  uint64_t payload_bytes_;
  uint64_t received_ = 0;
  Sha256 digest_;
  std::vector<Target> targets_;
  size_t current_ = 0;
};

}  // namespace halflight
