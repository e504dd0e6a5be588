// What is drawn, as plain structs: the renderer's whole input.
// Units: world units, right-handed; colours scene-linear; angles in radians. Values are taken as
// valid: whoever fills these structs has checked them (the service does so in server/convert).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace halflight {

// Opacities above this are drawn as this, since the optical depth of 1 is infinite.
inline constexpr float kMaxOpacity = 1.0F - 0x1p-20F;

// Lights of a scene, at most.
inline constexpr int kMaxLights = 16;

// Of ShadowSettings::fit_degree.
inline constexpr int kMaxFitDegree = 6;

// A particle cloud. Every attribute but the position may be empty, which means that the material's
// value serves for all particles; otherwise it has as many elements as positions.
struct ParticleSet {
  glm::dvec3 origin{0.0};
  std::vector<glm::vec3> positions;  // offsets of the centres from origin
  std::vector<float> radii;          // > 0
  std::vector<float> opacities;      // at the centre, [0, 1]
  std::vector<glm::vec3> colors;
  std::vector<glm::vec3> velocities;  // world units per second
  std::vector<glm::vec3> emissions;

  [[nodiscard]] size_t size() const { return positions.size(); }
};

struct Perspective {
  double vertical_fov;  // of the whole image
};

struct Orthographic {
  double height;  // of the whole image, world units
};

// A rectangle of pixels of the whole image, row 0 at the top.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

struct Camera {
  glm::dmat4 view_from_world{1.0};  // rigid; x right, y up, looking along -z
  std::variant<Perspective, Orthographic> projection = Perspective{0.698};
  int width = 640;  // of the whole image
  int height = 480;
  PixelRect window{0, 0, 640, 480};  // the part that is rendered
};

struct DirectionalLight {
  glm::dvec3 direction;  // of travel; unit length
};

struct PointLight {
  glm::dvec3 position;
  bool inverse_square_falloff = false;
};

struct Light {
  std::variant<DirectionalLight, PointLight> kind = DirectionalLight{{0.0, -1.0, 0.0}};
  glm::vec3 color{1.0F};
  glm::vec3 shadow_density{1.0F};  // per colour channel; all zero casts no shadow

  [[nodiscard]] bool casts_shadows() const { return shadow_density != glm::vec3(0.0F); }
  // Whether the three colour channels are attenuated differently.
  [[nodiscard]] bool colored_density() const {
    return shadow_density.x != shadow_density.y || shadow_density.y != shadow_density.z;
  }
};

enum class Profile : uint8_t { kSoft, kBall };

// A medium that scatters light, after Henyey and Greenstein 1941.
struct PhysicalScattering {
  float mean_cosine = 0.0F;  // [0, 1)
  float albedo = 1.0F;       // share of the light met that is scattered, not absorbed: [0, 1]

  bool operator==(const PhysicalScattering&) const = default;
};

struct Material {
  Profile profile = Profile::kSoft;
  float radius = 0.0F;  // where the set has none
  float opacity = 0.18F;
  glm::vec3 albedo{1.0F};  // times the particle's colour
  glm::vec3 emission{0.0F};
  glm::vec3 ambient{0.1F};
  float phase_g = 0.0F;
  // How light scatters on its way to a particle (docs/scattering.md); at most one of the two.
  float scattering_spread = 0.0F;  // world units of standard deviation at distance 1
  std::optional<PhysicalScattering> physical_scattering;

  [[nodiscard]] bool scatters_physically() const {
    return physical_scattering && physical_scattering->albedo > 0.0F;
  }
};

enum class ShadowTechniqueKind : uint8_t {
  kHalfAngle,
  kReference,   // the image model itself, on the CPU
  kLightSweep,  // exact order along each light, fitted over footprints
  // Uniform depth bins along each light, interpolated, fitted over footprints, on the CPU.
  kParticleShadowMap,
};
enum class SliceSpacing : uint8_t { kEqualCount, kEqualOpticalDepth };
// What half-angle slicing composites and deposits by.
enum class SliceCompositor : uint8_t {
  kAuto,    // what is faster on the device: see CompositorFor
  kRaster,  // one quad a particle through the blend units, slice after slice
  kTiles,   // tiles of the image and of the light buffer in compute
};
enum class BlurMode : uint8_t { kDistance, kTexelsPerSlice };

struct ShadowSettings {
  ShadowTechniqueKind technique = ShadowTechniqueKind::kHalfAngle;
  int slices = 128;
  bool interpolate = true;
  SliceSpacing spacing = SliceSpacing::kEqualCount;
  // Texels along each side of every light buffer; 0: as many as the frame needs, see
  // light_buffer_size.h, and at most max_light_buffer_size.
  int light_buffer_size = 0;
  int max_light_buffer_size = 4096;
  BlurMode blur_mode = BlurMode::kDistance;
  float blur_texels = 0.0F;  // with kTexelsPerSlice
  SliceCompositor compositor = SliceCompositor::kAuto;
  // With kLightSweep and kParticleShadowMap: of the polynomial in which a particle keeps the light
  // over its footprint, at most kMaxFitDegree.
  int fit_degree = 4;

  bool operator==(const ShadowSettings&) const = default;
};

// At most one of the two differs from 1.
struct Sampling {
  int supersample = 1;  // n x n samples a pixel
  int downsample = 1;   // one sample for n x n pixels

  bool operator==(const Sampling&) const = default;
};

struct Scene {
  std::shared_ptr<const ParticleSet> particles;
  double time_offset_s = 0.0;
  Camera camera;
  std::vector<Light> lights;
  Material material;
  ShadowSettings shadow;
  Sampling sampling;

  // Whether light spreads sideways where it shows: in shadows.
  [[nodiscard]] bool scatters() const {
    const bool spreads = shadow.blur_mode == BlurMode::kTexelsPerSlice
                             ? shadow.blur_texels > 0.0F
                             : material.scattering_spread > 0.0F || material.scatters_physically();
    return spreads && std::any_of(lights.begin(), lights.end(),
                                  [](const Light& light) { return light.casts_shadows(); });
  }
};

}  // namespace halflight
