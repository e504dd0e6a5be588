#include "tests/fuzz/requests.h"

#include "server/particle_upload.h"
#include "tests/fuzz/require.h"
#include "tests/server/made_particles.h"

namespace halflight::fuzz {

const Server& ServerOf(uint8_t choice) {
  static const auto* const servers = [] {
    DeviceInfo gpu;
    gpu.max_texture_size = 16384;
    DeviceInfo cpu = gpu;
    cpu.software = true;
    ServerLimits narrow;
    narrow.max_image_size = 64;
    narrow.max_light_buffer_size = 32;
    narrow.max_slices = 4;
    narrow.max_lights = 2;
    narrow.max_outputs = 3;
    narrow.max_output_bytes = 100'000;
    narrow.max_reference_work = 10'000;
    narrow.max_particles = 4;
    narrow.max_particle_bytes = 200;
    return new std::array<Server, 4>{
        {{ServerLimits{}, cpu}, {ServerLimits{}, gpu}, {narrow, cpu}, {narrow, gpu}}};
  }();
  return (*servers)[choice % servers->size()];
}

namespace {

struct Sets {
  ParticleStore store{1 << 20};
  std::vector<std::string> names;
};

Sets& AllSets() {
  static auto* const sets = [] {
    auto* const made = new Sets;
    for (const auto& attributes : std::vector<std::vector<v1::ParticleAttribute>>{
             {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS,
              v1::PARTICLE_ATTRIBUTE_OPACITY, v1::PARTICLE_ATTRIBUTE_COLOR,
              v1::PARTICLE_ATTRIBUTE_VELOCITY, v1::PARTICLE_ATTRIBUTE_EMISSION},
             {v1::PARTICLE_ATTRIBUTE_POSITION}}) {
      for (const int count : {0, 5}) {
        const auto built =
            BuildInlineParticles(testing::MakeParticles(count, attributes), ServerLimits{});
        Require(built.ok(), "the sets to begin with are sets");
        Require(made->store.Insert(built->sha256, built->set).ok(), "there is room");
        made->names.push_back(built->sha256);
      }
    }
    return made;
  }();
  return *sets;
}

}  // namespace

ParticleStore& StoreWithSets() { return AllSets().store; }

const std::vector<std::string>& NamesOfSets() { return AllSets().names; }

}  // namespace halflight::fuzz
