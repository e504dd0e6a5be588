// Lists made on the device against those of the CPU, and against the particles themselves.
#include "renderer/sweep/device/lists.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <span>

#include <glm/gtc/matrix_access.hpp>

#include "renderer/block_cache.h"
#include "renderer/sweep/device/runs.h"
#include "tests/renderer/device_fixture.h"
#include "tests/renderer/test_scene.h"

namespace halflight::sweep {
namespace {

constexpr glm::ivec2 kSize(101, 67);

template <typename T>
bool SameBytes(const std::vector<T>& a, const Block<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

// What a list is made of: particles in the unit ball, every tenth where another is too.
struct Cloud {
  Scene scene;
  Projection target;
  double near_depth = 0.0;
};

Cloud CloudFrom(const glm::dvec3& eye, size_t count = 20000) {
  Cloud cloud;
  cloud.scene = test::BallScene(count);
  test::VaryParticles(cloud.scene, 0.1F, 0.8F);
  auto set = std::make_shared<ParticleSet>(*cloud.scene.particles);
  for (size_t i = 10; i < count; i += 10) set->positions[i] = set->positions[i - 7];
  cloud.scene.particles = set;
  cloud.scene.camera = test::LookAt(eye, {0, 0, 0}, kSize.x, kSize.y);
  cloud.target = EyeProjection(cloud.scene.camera, kSize, 1.0);
  return cloud;
}

ParticleSet& Change(Cloud& cloud) {
  auto set = std::make_shared<ParticleSet>(*cloud.scene.particles);
  cloud.scene.particles = set;
  return *set;
}

struct CloudCase {
  const char* name;
  std::function<Cloud()> make;
};

const CloudCase kClouds[] = {
    {"Perspective",
     [] {
       return CloudFrom({1, 2, 4});
     }},
    {"Orthographic",
     [] {
       Cloud cloud = CloudFrom({1, 2, 4});
       cloud.scene.camera.projection = Orthographic{1.5};
       cloud.target = EyeProjection(cloud.scene.camera, kSize, 1.0);
       return cloud;
     }},
    // Half of the particles lie behind the eye.
    {"OrthographicWithin",
     [] {
       Cloud cloud = CloudFrom({0.01, 0.02, 0.03});
       cloud.scene.camera.projection = Orthographic{1.5};
       cloud.target = EyeProjection(cloud.scene.camera, kSize, 1.0);
       return cloud;
     }},
    {"NearTheEye",
     [] {
       Cloud cloud = CloudFrom({0.3, 0.2, 0.9});
       cloud.near_depth = 8.0;
       return cloud;
     }},
    {"Within",
     [] {
       Cloud cloud = CloudFrom({0.01, 0.02, 0.03});
       cloud.near_depth = 2.0;
       return cloud;
     }},
    {"Wide",
     [] {
       Cloud cloud = CloudFrom({0.1, 0.2, 0.5});
       cloud.scene.camera.projection = Perspective{170.0 * test::kDegree};
       cloud.target = EyeProjection(cloud.scene.camera, kSize, 1.0);
       return cloud;
     }},
    {"FarOrigin",
     [] {
       const glm::dvec3 origin(1e7, -1e7, 0.7e7);
       Cloud cloud = CloudFrom({1, 2, 4});
       Change(cloud).origin = origin;
       cloud.scene.camera = test::LookAt(origin + glm::dvec3(1, 2, 4), origin, kSize.x, kSize.y);
       cloud.target = EyeProjection(cloud.scene.camera, kSize, 1.0);
       return cloud;
     }},
    {"RadiiFrom1To1e5",
     [] {
       Cloud cloud = CloudFrom({1, 2, 4});
       ParticleSet& set = Change(cloud);
       for (size_t i = 0; i < set.size(); ++i) {
         set.radii[i] = 2e-5F * std::pow(10.0F, static_cast<float>(i % 500) * 0.01F);
       }
       cloud.near_depth = 2.0;
       return cloud;
     }},
    {"UniformAttributes",
     [] {
       Cloud cloud = CloudFrom({1, 2, 4});
       ParticleSet& set = Change(cloud);
       set.radii.clear();
       set.opacities.clear();
       return cloud;
     }},
    // Most are smaller than 1.5 texels, and enlarged.
    {"DirectionalLight",
     [] {
       Cloud cloud = CloudFrom({1, 2, 4});
       cloud.target = LightProjection(test::Sun({1, -1, -0.5}), ParticleView(cloud.scene), 48, 0.0);
       return cloud;
     }},
    {"PointLight",
     [] {
       Cloud cloud = CloudFrom({1, 2, 4});
       Light light;
       light.kind = PointLight{{0.5, 1.5, 0.2}};
       cloud.target = LightProjection(light, ParticleView(cloud.scene), 48, 0.0);
       return cloud;
     }},
    // So few texels over so wide an angle that particles in front of the light are enlarged to
    // hold it.
    {"EnlargedRoundTheEye",
     [] {
       Cloud cloud = CloudFrom({0, 0, 2});
       cloud.target.least_radius = 2.0;
       return cloud;
     }},
    {"One",
     [] {
       return CloudFrom({1, 2, 4}, 1);
     }},
    {"None",
     [] {
       return CloudFrom({1, 2, 4}, 0);
     }},
};

class ListDeviceSpritesOf : public test::DeviceTest, public testing::WithParamInterface<CloudCase> {
 protected:
  static absl::StatusOr<DeviceSprites> List(const Cloud& cloud) {
    const ParticleView particles(cloud.scene);
    return ListDeviceSprites(Device(), UploadParticles(particles), particles, cloud.target,
                             cloud.near_depth);
  }
};

TEST_P(ListDeviceSpritesOf, IsTheListOfTheCpu) {
  const Cloud cloud = GetParam().make();
  const SpriteList expected =
      ListSprites(ParticleView(cloud.scene), cloud.target, cloud.near_depth);
  const absl::StatusOr<DeviceSprites> list = List(cloud);
  ASSERT_TRUE(list.ok()) << list.status();
  const size_t count = expected.particles.size();
  ASSERT_EQ(list->count, count);
  EXPECT_TRUE(test::ReadBuffer<uint32_t>(list->particles, count) == expected.particles);
  EXPECT_TRUE(SameBytes(test::ReadBuffer<Sprite>(list->sprites, count), expected.sprites));
  EXPECT_TRUE(SameBytes(test::ReadBuffer<Rect>(list->rects, count), expected.rects));
  ASSERT_EQ(list->has_near, !expected.near.empty());
  if (!list->has_near) return;
  const auto near = test::ReadBuffer<glm::vec4>(list->near, count);
  for (size_t place = 0; place < count; ++place) {
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(near[place][axis], expected.near[place].center[axis]) << place;
    }
  }
}

// Along the ray of a pixel's centre: the impact parameter over the radius, and whether the ray
// meets the particle in front of the eye.
TEST_P(ListDeviceSpritesOf, HasAllPixelsOfAParticleInItsRectangle) {
  const Cloud cloud = GetParam().make();
  const ParticleView particles(cloud.scene);
  const absl::StatusOr<DeviceSprites> list = List(cloud);
  ASSERT_TRUE(list.ok()) << list.status();
  const auto order = test::ReadBuffer<uint32_t>(list->particles, list->count);
  const auto rects = test::ReadBuffer<Rect>(list->rects, list->count);
  const Projection& target = cloud.target;
  const glm::dmat3 rotation(target.view_from_world);
  size_t covered = 0;
  for (size_t place = 0; place < list->count; place += list->count / 500 + 1) {
    const glm::dvec3 center = rotation * (glm::dvec3(particles.positions()[order[place]]) +
                                          (particles.set().origin - target.eye()));
    if (target.orthographic && center.z >= 0.0) continue;
    const double radius = std::max<double>(
        particles.radius(order[place]),
        target.least_radius * (target.orthographic ? 1.0 : std::max(-center.z, 0.0)));
    for (int y = 0; y < target.size.y; ++y) {
      for (int x = 0; x < target.size.x; ++x) {
        const glm::dvec2 plane =
            (glm::dvec2(x + 0.5, y + 0.5) - target.pixel_offset) / target.pixel_from_plane;
        const glm::dvec3 ray = target.orthographic ? glm::dvec3(0.0, 0.0, -1.0)
                                                   : glm::normalize(glm::dvec3(plane, -1.0));
        const glm::dvec3 from = target.orthographic ? glm::dvec3(plane, 0.0) : glm::dvec3(0.0);
        const double along = glm::dot(center - from, ray);
        if (along <= 0.0 || glm::distance(center, from + along * ray) >= radius) continue;
        ++covered;
        const Rect& rect = rects[place];
        ASSERT_TRUE(x >= rect.x_begin && x < rect.x_end && y >= rect.y_begin && y < rect.y_end)
            << "pixel " << x << ", " << y << " of particle " << order[place];
      }
    }
  }
  EXPECT_TRUE(covered > 0 || list->count < 2);
}

TEST_P(ListDeviceSpritesOf, HasTheTilesOfTheCpu) {
  const Cloud cloud = GetParam().make();
  const absl::StatusOr<DeviceSprites> sprites = List(cloud);
  ASSERT_TRUE(sprites.ok()) << sprites.status();
  const auto read = test::ReadBuffer<Rect>(sprites->rects, sprites->count);
  const Block<Rect> rects(read.begin(), read.end());
  for (const int tile_size : {8, 64, 128}) {
    const TileLists expected = ListTiles(rects, cloud.target.size, tile_size);
    const DeviceTiles uploaded = UploadTiles(expected);
    const absl::StatusOr<DeviceTiles> lists = ListDeviceTiles(
        Device(), sprites->rects, {0, sprites->count}, cloud.target.size, tile_size);
    ASSERT_TRUE(lists.ok()) << lists.status();
    EXPECT_EQ(lists->tiles, uploaded.tiles);
    EXPECT_EQ(lists->tile_size, tile_size);
    ASSERT_EQ(lists->entry_count, uploaded.entry_count);
    const size_t begins = expected.begin.size();
    EXPECT_TRUE(test::ReadBuffer<uint32_t>(lists->begin, begins) ==
                test::ReadBuffer<uint32_t>(uploaded.begin, begins));
    EXPECT_TRUE(test::ReadBuffer<uint32_t>(lists->entries, lists->entry_count) ==
                test::ReadBuffer<uint32_t>(uploaded.entries, lists->entry_count));
  }
}

INSTANTIATE_TEST_SUITE_P(Clouds, ListDeviceSpritesOf, testing::ValuesIn(kClouds),
                         [](const auto& tested) { return tested.param.name; });

class DeviceListsTest : public test::DeviceTest {};

// Runs that begin where no binding may, one that is empty, and one that holds what is left.
TEST_F(DeviceListsTest, OfRunsTogetherAreTheTilesOfAll) {
  const Cloud cloud = CloudFrom({1, 2, 4});
  const SpriteList list = ListSprites(ParticleView(cloud.scene), cloud.target);
  const DeviceSprites sprites = UploadSprites(list);
  const TileLists expected = ListTiles(list.rects, kSize, 8);
  const size_t tiles = expected.begin.size() - 1;
  std::vector<std::vector<uint32_t>> entries(tiles);
  const size_t ends[] = {0, 1, 33, 33, 7001, list.rects.size()};
  for (size_t r = 0; r + 1 < std::size(ends); ++r) {
    const absl::StatusOr<DeviceTiles> run =
        ListDeviceTiles(Device(), sprites.rects, {ends[r], ends[r + 1]}, kSize, 8);
    ASSERT_TRUE(run.ok()) << run.status();
    const auto begin = test::ReadBuffer<uint32_t>(run->begin, tiles + 1);
    const auto places = test::ReadBuffer<uint32_t>(run->entries, run->entry_count);
    EXPECT_EQ(begin[tiles], run->entry_count);
    for (size_t tile = 0; tile < tiles; ++tile) {
      entries[tile].insert(entries[tile].end(), places.begin() + begin[tile],
                           places.begin() + begin[tile + 1]);
    }
  }
  for (size_t tile = 0; tile < tiles; ++tile) {
    ASSERT_EQ(entries[tile].size(), expected.begin[tile + 1] - expected.begin[tile]);
    for (size_t e = 0; e < entries[tile].size(); ++e) {
      ASSERT_EQ(entries[tile][e], expected.entries[expected.begin[tile] + e]);
    }
  }
}

// Together the order, each within its limits and with as many entries as its lists turn out to
// have.
TEST_F(DeviceListsTest, AreCutIntoRunsThatTellTheirEntries) {
  const Cloud cloud = CloudFrom({1, 2, 4});
  const SpriteList list = ListSprites(ParticleView(cloud.scene), cloud.target);
  const DeviceSprites sprites = UploadSprites(list);
  for (const size_t most : {size_t{1}, size_t{1000}, list.rects.size()}) {
    const auto runs = CutIntoListedRuns(Device(), sprites, 8, most);
    ASSERT_TRUE(runs.ok()) << runs.status();
    size_t end = 0;
    for (const ListedRun& run : *runs) {
      EXPECT_EQ(run.places.first, end);
      EXPECT_LE(run.places.end - run.places.first, std::max<size_t>(most, shader::kScanGroupSize));
      end = run.places.end;
      const std::span<const Rect> rects(list.rects);
      const auto of_run = rects.subspan(run.places.first, end - run.places.first);
      ASSERT_EQ(run.entries, ListTiles(of_run, kSize, 8).entries.size());
    }
    EXPECT_EQ(end, list.rects.size());
  }
  for (const size_t entries : {size_t{700}, size_t{40'000}}) {
    const auto patches = CutIntoPatchRuns(Device(), sprites, 16, {.entries = entries});
    ASSERT_TRUE(patches.ok()) << patches.status();
    size_t end = 0;
    for (const PatchRun& run : patches->runs) {
      EXPECT_EQ(run.places.first, end);
      EXPECT_LE(run.entries, entries);
      end = run.places.end;
      const std::span<const Rect> rects(list.rects);
      const auto of_run = rects.subspan(run.places.first, end - run.places.first);
      ASSERT_EQ(run.entries, ListTiles(of_run, kSize, 16).entries.size());
    }
    EXPECT_EQ(end, list.rects.size());
  }
}

TEST_F(DeviceListsTest, AreTheSameEveryTime) {
  const Cloud cloud = CloudFrom({0.3, 0.2, 0.9});
  const ParticleView particles(cloud.scene);
  const ParticleBuffers buffers = UploadParticles(particles);
  std::vector<uint32_t> first;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto sprites = ListDeviceSprites(Device(), buffers, particles, cloud.target);
    ASSERT_TRUE(sprites.ok()) << sprites.status();
    const auto tiles = ListDeviceTiles(Device(), sprites->rects, {0, sprites->count}, kSize, 8);
    ASSERT_TRUE(tiles.ok()) << tiles.status();
    auto entries = test::ReadBuffer<uint32_t>(tiles->entries, tiles->entry_count);
    if (repeat == 0) first = entries;
    EXPECT_TRUE(entries == first);
  }
}

// 2000 particles over 65,535 x 65,535 pixels are more entries than can be numbered.
TEST_F(DeviceListsTest, NamesTheLimitThatTooManyEntriesExceed) {
  SpriteList list;
  list.particles.resize(2000);
  list.sprites.resize(2000);
  list.rects.resize(2000, {0, 65535, 0, 65535});
  const absl::Status status =
      ListDeviceTiles(Device(), UploadSprites(list).rects, {0, 2000}, {65535, 65535}, 32).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_NE(status.message().find("GL_MAX_SHADER_STORAGE_BLOCK_SIZE"), std::string::npos) << status;
}

// More tiles than an invocation may count (65,535) under one particle.
TEST_F(DeviceListsTest, ListAParticleOverAsManyTilesAsThereAre) {
  constexpr glm::ivec2 kLarge(4096, 4000);
  SpriteList list;
  list.particles = {0, 1, 2};
  list.sprites.resize(3);
  list.rects = {{5, 6, 9, 10}, {0, 4096, 0, 4000}, {}};
  const auto tiles = ListDeviceTiles(Device(), UploadSprites(list).rects, {0, 3}, kLarge, 8);
  ASSERT_TRUE(tiles.ok()) << tiles.status();
  const TileLists expected = ListTiles(list.rects, kLarge, 8);
  ASSERT_EQ(tiles->entry_count, size_t{512} * 500 + 1);
  const auto begin = test::ReadBuffer<uint32_t>(tiles->begin, expected.begin.size());
  EXPECT_TRUE(std::equal(begin.begin(), begin.end(), expected.begin.begin()));
}

}  // namespace
}  // namespace halflight::sweep
