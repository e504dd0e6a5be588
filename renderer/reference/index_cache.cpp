// Entries in the order of their use; see index_cache.h.
#include "renderer/reference/index_cache.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace halflight::reference {

bool IndexCache::Key::operator==(const Key& other) const {
  const auto all = [](const Key& key) {
    return std::tie(key.kind, key.time_offset_s, key.profile, key.radius, key.opacity, key.albedo,
                    key.emission, key.rays);
  };
  // By owner: another set may have come to lie where one that is gone lay.
  return !set.owner_before(other.set) && !other.set.owner_before(set) && all(*this) == all(other);
}

IndexCache::Key IndexCache::KeyOf(const Scene& scene, Kind kind, const std::optional<Rays>& rays) {
  const Material& material = scene.material;
  return {.kind = kind,
          .set = scene.particles,
          .time_offset_s = scene.time_offset_s,
          .profile = material.profile,
          .radius = material.radius,
          .opacity = material.opacity,
          .albedo = material.albedo,
          .emission = material.emission,
          .rays = rays};
}

std::shared_ptr<const void> IndexCache::Find(const Key& key) {
  const std::lock_guard lock(mutex_);
  DropThoseOfSetsGone();
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&key](const Entry& entry) { return entry.key == key; });
  if (found == entries_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found);
  return found->value;
}

void IndexCache::Keep(Entry entry) {
  if (entry.bytes > max_bytes_) return;
  const std::lock_guard lock(mutex_);
  // Somebody else may have made the same meanwhile.
  const bool there = std::any_of(entries_.begin(), entries_.end(),
                                 [&entry](const Entry& other) { return other.key == entry.key; });
  if (there) return;
  bytes_ += entry.bytes;
  entries_.push_front(std::move(entry));
  while (bytes_ > max_bytes_) {
    bytes_ -= entries_.back().bytes;
    entries_.pop_back();
  }
}

void IndexCache::DropThoseOfSetsGone() {
  entries_.remove_if([this](const Entry& entry) {
    const bool gone = entry.key.set.expired();
    bytes_ -= gone ? entry.bytes : 0;
    return gone;
  });
}

template <typename T, typename Make, typename BytesOf>
std::shared_ptr<const T> IndexCache::FindOrMake(const Key& key, const std::stop_token& stop,
                                                const Make& make, const BytesOf& bytes_of) {
  if (auto found = Find(key)) return std::static_pointer_cast<const T>(found);
  std::shared_ptr<const T> made = make();
  if (!stop.stop_requested()) Keep({key, made, bytes_of(*made)});
  return made;
}

std::shared_ptr<const Cloud> IndexCache::ParticlesOf(const Scene& scene) {
  return FindOrMake<Cloud>(
      KeyOf(scene, Kind::kParticles, std::nullopt), {},
      [&] { return std::make_shared<const Cloud>(ResolveCloud(scene)); },
      [](const Cloud& cloud) { return cloud.particles.size() * sizeof(Particle); });
}

std::shared_ptr<const LightDepth> IndexCache::DepthOf(const Scene& scene, const Cloud& cloud,
                                                      const Rays& light,
                                                      const std::stop_token& stop) {
  return FindOrMake<LightDepth>(
      KeyOf(scene, Kind::kLight, light), stop,
      [&] {
        return std::make_shared<const LightDepth>(light, cloud, OrderFromLight(light, cloud, stop),
                                                  stop);
      },
      [](const LightDepth& depth) { return depth.bytes(); });
}

std::shared_ptr<const EyeIndex> IndexCache::EyeIndexOf(const Scene& scene, const Cloud& cloud,
                                                       const Rays& eye,
                                                       const std::stop_token& stop) {
  return FindOrMake<EyeIndex>(
      KeyOf(scene, Kind::kEye, eye), stop,
      [&] { return std::make_shared<const EyeIndex>(eye, cloud, stop); },
      [](const EyeIndex& index) { return index.bytes(); });
}

size_t IndexCache::bytes() {
  const std::lock_guard lock(mutex_);
  DropThoseOfSetsGone();
  return bytes_;
}

}  // namespace halflight::reference
