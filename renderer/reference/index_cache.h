// What the reference works out of the particles before it looks at a pixel, kept for the next
// frame: a second pass over a frame finds all of it, a frame that only moved the camera what
// belongs to the lights. Leaves out pixels, and changes no figure: what is found is what would be
// made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include <glm/vec3.hpp>

#include "renderer/reference/cloud.h"
#include "renderer/reference/compositor.h"
#include "renderer/reference/light_depth.h"
#include "renderer/reference/rays.h"
#include "renderer/scene.h"

namespace halflight::reference {

// Any thread. A set of particles is told from others by its object, which must not change while
// the cache lives; the cache does not keep it alive.
class IndexCache {
 public:
  // Holds no more than `max_bytes`, without what is in use elsewhere: the least recently used goes
  // first, and what is larger by itself is not kept.
  explicit IndexCache(size_t max_bytes) : max_bytes_(max_bytes) {}

  // Found, or made and kept. `cloud` is the scene's. What was made when `stop` was requested is of
  // some of the particles only, and not kept.
  std::shared_ptr<const Cloud> ParticlesOf(const Scene& scene);
  std::shared_ptr<const LightDepth> DepthOf(const Scene& scene, const Cloud& cloud,
                                            const Rays& light, const std::stop_token& stop);
  std::shared_ptr<const EyeIndex> EyeIndexOf(const Scene& scene, const Cloud& cloud,
                                             const Rays& eye, const std::stop_token& stop);

  // Of what is kept. That of sets which are gone goes first, as with every other call.
  [[nodiscard]] size_t bytes();

 private:
  enum class Kind : uint8_t { kParticles, kLight, kEye };

  // Everything that an entry depends on.
  struct Key {
    Kind kind;
    std::weak_ptr<const ParticleSet> set;
    double time_offset_s;
    Profile profile;
    float radius;
    float opacity;
    glm::vec3 albedo;
    glm::vec3 emission;
    std::optional<Rays> rays;

    bool operator==(const Key& other) const;
  };
  struct Entry {
    Key key;
    std::shared_ptr<const void> value;  // as its kind says
    size_t bytes;
  };

  static Key KeyOf(const Scene& scene, Kind kind, const std::optional<Rays>& rays);
  // `make` gives the value; `bytes_of` its size.
  template <typename T, typename Make, typename BytesOf>
  std::shared_ptr<const T> FindOrMake(const Key& key, const std::stop_token& stop, const Make& make,
                                      const BytesOf& bytes_of);
  std::shared_ptr<const void> Find(const Key& key);
  void Keep(Entry entry);
  void DropThoseOfSetsGone();

  const size_t max_bytes_;
  std::mutex mutex_;
  std::list<Entry> entries_;  // guarded by mutex_; most recently used first
  size_t bytes_ = 0;          // guarded by mutex_
};

}  // namespace halflight::reference
