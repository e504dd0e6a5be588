// The eye pass on the device against that of the CPU: what both make of the same particles, lights
// and order.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <string>

#include "renderer/block_cache.h"
#include "renderer/frame_engine.h"
#include "renderer/frame_images.h"
#include "renderer/raster_pieces.h"
#include "renderer/stage_clock.h"
#include "renderer/sweep/compositor.h"
#include "renderer/sweep/device/compositor.h"
#include "renderer/sweep/device/frame.h"
#include "tests/renderer/device_fixture.h"
#include "tests/renderer/test_scene.h"
#include "tests/sweep/fitted_light.h"

namespace halflight::sweep {
namespace {

// As llvmpipe needs it.
constexpr TileWalk kWalk = {.tile_size = 8, .most_iterations = 60000};

struct EyeImages {
  Image beauty;
  Image depth;
  std::vector<Image> transmittance;  // by light of the scene; empty where it casts no shadows
};

// What an eye pass begins with, made on the CPU.
class EyePass {
 public:
  explicit EyePass(const Scene& scene) : scene_(scene), particles_(scene_) {
    const glm::ivec2 size(scene.camera.window.width, scene.camera.window.height);
    eye_ = EyeProjection(scene.camera, size, 1.0);
    list_ = ListSprites(particles_, eye_, NearDepth(scene));
    for (size_t light = 0; light < scene_.lights.size(); ++light) {
      fits_.emplace_back();
      if (!scene_.lights[light].casts_shadows()) continue;
      auto fit =
          FitLight(scene_, particles_, PlanLight(scene_, particles_, static_cast<int>(light)), {});
      EXPECT_TRUE(fit.ok()) << fit.status();
      if (fit.ok()) fits_.back() = *std::move(fit);
    }
  }

  [[nodiscard]] EyeImages OnCpu() const {
    std::vector<const LightFit*> fits;
    for (const LightFit& fit : fits_) fits.push_back(fit.depth.empty() ? nullptr : &fit);
    const std::vector<TileLight> lights = ListTileLights(scene_, true);
    Composite composite = MakeComposite(eye_.size, true, lights.size());
    for (const TileRun& run : CutIntoRuns(list_.rects, kImageTile, {})) {
      const TileLists tiles =
          ListTiles(std::span(list_.rects).subspan(run.begin, run.size()), eye_.size, kImageTile);
      const Shading shading = ShadeSprites(scene_, particles_, eye_, list_, run, lights, fits,
                                           scene_.shadow.fit_degree, true);
      EXPECT_TRUE(
          CompositeRun(list_, tiles, shading, eye_, scene_.material.profile, {}, composite));
    }
    EyeImages images{std::move(composite.beauty), std::move(composite.depth), {}};
    for (size_t l = 0; l < fits_.size(); ++l) {
      images.transmittance.emplace_back();
      if (fits[l] == nullptr) continue;
      const int slot = TransmittanceSlot(lights, static_cast<int>(l));
      images.transmittance.back() = composite.transmittance[static_cast<size_t>(slot)];
    }
    return images;
  }

  // In runs of at most so many places.
  [[nodiscard]] EyeImages OnDevice(Gpu& gpu, const TileWalk& walk, size_t most_places) const {
    const ParticleBuffers buffers = UploadParticles(particles_);
    const TargetProjection eye = UploadProjection(eye_, particles_);
    const DeviceSprites sprites = UploadSprites(list_);
    std::vector<DeviceLightFit> uploaded;
    for (const LightFit& fit : fits_) {
      uploaded.push_back({fit.projection,
                          fit.degree,
                          gl::MakeBuffer("fit", fit.depth),
                          gl::MakeBuffer("sprites", SpritesByParticle(particles_, fit.projection)),
                          {}});
    }
    std::vector<const DeviceLightFit*> fits;
    for (size_t l = 0; l < fits_.size(); ++l) {
      fits.push_back(fits_[l].depth.empty() ? nullptr : &uploaded[l]);
    }
    const ShadedLayout layout =
        LayOutShading(scene_, sprites, scene_.shadow.fit_degree, true, true);
    std::vector<int> slots;
    for (size_t l = 0; l < fits_.size(); ++l) {
      if (fits[l] != nullptr)
        slots.push_back(TransmittanceSlot(layout.lights, static_cast<int>(l)));
    }
    const TileTargets targets = MakeTileTargets(eye_.size, layout, slots);
    for (size_t first = 0; first < sprites.count; first += most_places) {
      const PlaceRun run{first, std::min(first + most_places, sprites.count)};
      const auto shaded = ShadePlaces(gpu, scene_, buffers, eye, sprites, fits, layout, run);
      EXPECT_TRUE(shaded.ok()) << shaded.status();
      Block<Rect> rects(sprites.count);  // none but the run's
      std::copy(list_.rects.begin() + static_cast<ptrdiff_t>(run.first),
                list_.rects.begin() + static_cast<ptrdiff_t>(run.end),
                rects.begin() + static_cast<ptrdiff_t>(run.first));
      const DeviceTiles tiles = UploadTiles(ListTiles(rects, eye_.size, walk.tile_size));
      const absl::Status status =
          CompositePlaces(gpu, scene_, eye, layout, *shaded, tiles, walk, targets, {});
      EXPECT_TRUE(status.ok()) << status;
    }
    EyeImages images{test::ReadTexture(targets.beauty), test::ReadTexture(targets.depth), {}};
    for (size_t l = 0; l < fits_.size(); ++l) {
      images.transmittance.emplace_back();
      if (fits[l] == nullptr) continue;
      const int slot = TransmittanceSlot(layout.lights, static_cast<int>(l));
      images.transmittance.back() =
          test::ReadTexture(targets.transmittance[static_cast<size_t>(slot)]);
    }
    return images;
  }

  [[nodiscard]] size_t size() const { return particles_.size(); }
  [[nodiscard]] bool has_near() const { return !list_.near.empty(); }

 private:
  Scene scene_;
  ParticleView particles_;
  Projection eye_;
  SpriteList list_;
  std::vector<LightFit> fits_;
};

// The largest difference, of values that reach `largest`.
double Difference(const Image& a, const Image& b) {
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  double largest = 0.0;
  double difference = 0.0;
  for (size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i) {
    largest = std::max<double>(largest, std::abs(b.pixels[i]));
    const double off = std::abs(static_cast<double>(a.pixels[i]) - b.pixels[i]);
    difference = std::isnan(off) ? 1e30 : std::max(difference, off);
  }
  return difference / std::max(largest, 1e-30);
}

struct EyeDifference {
  double beauty = 0.0;
  double depth = 0.0;
  double transmittance = 0.0;
};

EyeDifference DifferenceOf(const EyeImages& a, const EyeImages& b) {
  EyeDifference off{Difference(a.beauty, b.beauty), Difference(a.depth, b.depth), 0.0};
  for (size_t l = 0; l < a.transmittance.size(); ++l) {
    off.transmittance =
        std::max(off.transmittance, Difference(a.transmittance[l], b.transmittance[l]));
  }
  return off;
}

void ExpectBelow(const EyeDifference& off, double tolerance, const std::string& name) {
  std::cout << name << ": beauty " << off.beauty << ", depth " << off.depth << ", transmittance "
            << off.transmittance << "\n";
  EXPECT_LT(off.beauty, tolerance) << name;
  EXPECT_LT(off.depth, tolerance) << name;
  EXPECT_LT(off.transmittance, tolerance) << name;
}

Scene CloudScene() {
  Scene scene = test::BallScene(1500);
  scene.camera = test::LookAt({0, 0.3, 4}, {0, 0, 0}, 61, 43);
  return scene;
}

class DeviceEye : public test::DeviceTest {};

TEST_F(DeviceEye, AgreesWithTheCpuAtEveryDegree) {
  Scene scene = CloudScene();
  for (int degree = 0; degree <= kMaxDegree; ++degree) {
    scene.shadow.fit_degree = degree;
    const EyePass pass(scene);
    const EyeImages device = pass.OnDevice(
        Device(), {.tile_size = degree == 3 ? 16 : 8, .most_iterations = 60000}, pass.size());
    ExpectBelow(DifferenceOf(device, pass.OnCpu()), 1e-5, "degree " + std::to_string(degree));
  }
}

// In many runs and dispatches, each of which goes on where the one before ended.
TEST_F(DeviceEye, IsTheSameInParts) {
  Scene scene = CloudScene();
  scene.lights.push_back(test::Sun({-1, -0.2, 0.3}, 0.5F));
  const EyePass pass(scene);
  const EyeImages at_once = pass.OnDevice(Device(), kWalk, pass.size());
  EXPECT_EQ(pass.OnDevice(Device(), kWalk, pass.size()).beauty.pixels, at_once.beauty.pixels);
  ExpectBelow(DifferenceOf(pass.OnDevice(Device(), kWalk, kShadedAlignment), at_once), 2e-6,
              "runs");
  ExpectBelow(
      DifferenceOf(pass.OnDevice(Device(), {.tile_size = 8, .most_iterations = 1}, 512), at_once),
      2e-6, "dispatches");
}

TEST_F(DeviceEye, DrawsFramesInRuns) {
  const FrameRequest request = test::Beauty(CloudScene());
  const ParticleView particles(request.scene);
  const auto plan = PlanFrame(request, particles);
  ASSERT_TRUE(plan.ok()) << plan.status();
  DeviceInfo device;
  device.max_texture_size = 1024;
  device.software = true;
  StageClock clock;
  FrameCache nothing_kept(0);
  RasterPieces pieces(device.software);
  const DrawContext context{Device(),  device, nothing_kept, pieces, request,
                            particles, *plan,  clock,        {}};
  const auto at_once = DrawOnDevice(context);
  const auto in_runs = DrawOnDevice(context, {.most_run_bytes = 1});
  ASSERT_TRUE(at_once.ok()) << at_once.status();
  ASSERT_TRUE(in_runs.ok()) << in_runs.status();
  EXPECT_LT(Difference(in_runs->arriving->drawn.beauty, at_once->arriving->drawn.beauty), 2e-6);
}

// One behind another, each over all of the image.
Scene StackScene(size_t count, float opacity) {
  Scene scene;
  auto set = std::make_shared<ParticleSet>();
  for (size_t i = 0; i < count; ++i) {
    set->positions.emplace_back(0.0F, 0.0F, -static_cast<float>(i) / static_cast<float>(count));
  }
  scene.particles = set;
  scene.camera = test::LookAt({0, 0, 4}, {0, 0, 0}, 8, 8);
  scene.camera.projection = Orthographic{1e-3};
  scene.material.radius = 1.0F;
  scene.material.opacity = opacity;
  scene.material.ambient = glm::vec3(1.0F);
  return scene;
}

TEST_F(DeviceEye, AddsUpAMillionThinLayers) {
  const Scene scene = StackScene(1'000'000, 1e-6F);
  const EyePass pass(scene);
  const Image image = pass.OnDevice(Device(), kWalk, pass.size()).beauty;
  const double expected = 1.0 - std::exp(-ParticleView(scene).uniform_optical_depth() * 1e6);
  for (const float value : image.pixels) EXPECT_NEAR(value, expected, 3e-6);
}

// The first layers hide the rest, which is not even read, in this run or in the next: infinite
// colours would make it show.
TEST_F(DeviceEye, HidesWhatLiesBehindOpaqueLayers) {
  Scene scene = StackScene(1024, 0.99F);
  auto set = std::make_shared<ParticleSet>(*scene.particles);
  set->colors.resize(set->size(), glm::vec3(std::numeric_limits<float>::infinity()));
  for (size_t i = 0; i < 64; ++i) set->colors[i] = {0.25F, 0.5F, 1.0F};
  scene.particles = set;
  const EyePass pass(scene);
  const Image image = pass.OnDevice(Device(), kWalk, 512).beauty;
  for (size_t i = 0; i < image.pixels.size(); i += 4) {
    EXPECT_NEAR(image.pixels[i], 0.25F, 1e-6);
    EXPECT_NEAR(image.pixels[i + 2], 1.0F, 1e-6);
    EXPECT_NEAR(image.pixels[i + 3], 1.0F, 1e-6);
  }
}

TEST_F(DeviceEye, OfNothingIsNothing) {
  Scene scene = CloudScene();
  scene.particles = std::make_shared<ParticleSet>();
  scene.lights.clear();
  for (const float value : EyePass(scene).OnDevice(Device(), kWalk, 1).beauty.pixels) {
    EXPECT_EQ(value, 0.0F);
  }
}

struct EyeCase {
  const char* name;
  void (*change)(Scene&);
  double tolerance;
};

Light Point(const glm::dvec3& position, bool falloff) {
  Light light;
  light.kind = PointLight{position, falloff};
  return light;
}

// Pixels are rounded on the plane by up to 2^-25: over a sprite's radius there, times twice its
// optical depth, that is how far two opacities may be off, and more at the rim of a ball. Particles
// of a pixel's size and opacity 0.9 are off most.
constexpr EyeCase kEyeCases[] = {
    EyeCase{"NoLights", [](Scene& s) { s.lights.clear(); }, 1e-5},
    EyeCase{"Balls", [](Scene& s) { s.material.profile = Profile::kBall; }, 1e-5},
    EyeCase{"ParallelRays", [](Scene& s) { s.camera.projection = Orthographic{2.4}; }, 1e-5},
    EyeCase{"PointLight",
            [](Scene& s) {
              s.lights = {Point({1.5, 3, 1.2}, false)};
            },
            1e-5},
    EyeCase{"FallingOff",
            [](Scene& s) {
              s.lights = {Point({2, 3.5, 2}, true)};
            },
            1e-5},
    EyeCase{"FallingOffParallelRays",
            [](Scene& s) {
              s.lights = {Point({2, 3.5, 2}, true)};
              s.camera.projection = Orthographic{2.4};
            },
            1e-5},
    EyeCase{"ColoredDensity",
            [](Scene& s) {
              s.lights[0].shadow_density = {0.5F, 1.0F, 2.0F};
            },
            1e-5},
    EyeCase{"Phase",
            [](Scene& s) {
              s.material.phase_g = 0.6F;
              s.lights.push_back(test::Sun({0.3, -0.4, 1}, 0.0F));
            },
            1e-5},
    EyeCase{"VariedParticles", [](Scene& s) { test::VaryParticles(s, 0.02F, 0.9F); }, 4e-5},
    EyeCase{"ManyLights",
            [](Scene& s) {
              s.shadow.fit_degree = 6;
              s.shadow.light_buffer_size = 64;
              s.lights.clear();
              for (int l = 0; l < kMaxLights; ++l) {
                s.lights.push_back(test::Sun({std::cos(l), -1.0, std::sin(l)}, 0.5F));
                s.lights.back().color = glm::vec3(0.1F * static_cast<float>(l), 0.3F, 0.5F);
              }
              s.lights[3].shadow_density = {0.1F, 1.0F, 3.0F};
              s.lights[5] = Point({3, 2, 2}, true);
              s.lights[7].shadow_density = glm::vec3(0.0F);
              s.material.phase_g = 0.3F;
            },
            1e-5},
    EyeCase{"CameraAmongThem",
            [](Scene& s) {
              s.camera = test::LookAt({0.1, 0.2, 0.4}, {0, 0, -0.2}, 61, 43);
              s.camera.projection = Perspective{110 * test::kDegree};
              s.material.opacity = 0.1F;
            },
            1e-5},
    EyeCase{"CameraAmongThemUnderAPointLight",
            [](Scene& s) {
              s.camera = test::LookAt({0.1, 0.2, 0.4}, {0, 0, -0.2}, 61, 43);
              s.camera.projection = Perspective{110 * test::kDegree};
              s.material.opacity = 0.1F;
              s.lights = {Point({2, 3.5, 2}, true)};
              s.lights[0].shadow_density = {0.5F, 1.0F, 2.0F};
            },
            1e-5},
    EyeCase{"ACutOfALargeImage",
            [](Scene& s) {
              s.camera.width = 6100;
              s.camera.height = 4300;
              s.camera.window = {3000, 2500, 70, 50};
            },
            1e-5},
    EyeCase{"FarFromTheOrigin",
            [](Scene& s) {
              const glm::dvec3 away(1e7, -2e7, 5e6);
              auto set = std::make_shared<ParticleSet>(*s.particles);
              set->origin += away;
              s.particles = set;
              s.camera.view_from_world = glm::translate(s.camera.view_from_world, -away);
              s.camera.projection = Orthographic{2.4};
            },
            1e-5},
};

// One test for all: each process compiles its shaders anew.
TEST_F(DeviceEye, AgreesWithTheCpu) {
  for (const EyeCase& tested : kEyeCases) {
    Scene scene = CloudScene();
    tested.change(scene);
    const EyePass pass(scene);
    const EyeImages device = pass.OnDevice(Device(), kWalk, pass.size());
    ExpectBelow(DifferenceOf(device, pass.OnCpu()), tested.tolerance, tested.name);
  }
}

}  // namespace
}  // namespace halflight::sweep
