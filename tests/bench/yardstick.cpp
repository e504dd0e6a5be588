#include "tests/bench/yardstick.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <barrier>
#include <chrono>
#include <cmath>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "tests/bench/yardstick_kernels.h"

namespace halflight::bench {
namespace {

using kernels::Rect;

// What shines through a tile at most where it is left: as little as the last digit of 8 bits shows.
constexpr float kEnough = 1.0F / 2048.0F;
// Up to which the polynomial below holds to 1e-3.
constexpr double kMostOpticalDepth = 1.5;

struct Keyed {
  uint32_t key;
  uint32_t index;
};

// Radix sort, 11 bits a digit; stable.
void SortByKey(std::span<const uint32_t> keys, std::vector<Keyed>& first,
               std::vector<Keyed>& second, uint32_t* order) {
  constexpr uint32_t kBits = 11;
  constexpr uint32_t kMask = (1U << kBits) - 1U;
  std::array<std::array<uint32_t, kMask + 1>, 3> next{};
  for (const uint32_t key : keys) {
    ++next[0][key & kMask];
    ++next[1][key >> kBits & kMask];
    ++next[2][key >> 2 * kBits];
  }
  for (auto& digit : next) {
    uint32_t sum = 0;
    for (uint32_t& count : digit) sum += std::exchange(count, sum);
  }
  for (uint32_t i = 0; i < keys.size(); ++i) first[next[0][keys[i] & kMask]++] = {keys[i], i};
  for (const Keyed& item : first) second[next[1][item.key >> kBits & kMask]++] = item;
  for (const Keyed& item : second) order[next[2][item.key >> 2 * kBits]++] = item.index;
}

// 1 - exp(-tau w) on [0, 1] as w times a cubic: the interpolation at Chebyshev's nodes, by Newton's
// divided differences.
kernels::Opacity OpacityOf(double tau) {
  constexpr std::array<double, 4> kNodes = {0.0380602337, 0.3086582838, 0.6913417162, 0.9619397663};
  std::array<double, 4> difference{};
  for (size_t k = 0; k < 4; ++k) difference[k] = -std::expm1(-tau * kNodes[k]) / kNodes[k];
  for (size_t order = 1; order < 4; ++order) {
    for (size_t k = 3; k >= order; --k) {
      difference[k] = (difference[k] - difference[k - 1]) / (kNodes[k] - kNodes[k - order]);
    }
  }
  std::array<double, 4> power{};
  for (int k = 3; k >= 0; --k) {  // power = power * (w - node) + difference
    for (size_t i = 3; i > 0; --i) power[i] = power[i - 1] - power[i] * kNodes[k];
    power[0] = difference[k] - power[0] * kNodes[k];
  }
  kernels::Opacity opacity{};
  for (size_t i = 0; i < 4; ++i) opacity.of_power[i] = static_cast<float>(power[i]);
  return opacity;
}

absl::Status Refuse(const char* field, const char* allowed) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": allowed for the yardstick: ", allowed));
}

absl::Status CheckRequest(const FrameRequest& request) {
  const Scene& scene = request.scene;
  const ParticleSet& set = *scene.particles;
  const Material& material = scene.material;
  const Camera& camera = scene.camera;
  if (request.images.size() != 1 || request.images[0].kind != ImageKind::kBeauty) {
    return Refuse("images", "the beauty alone");
  }
  if (set.positions.empty() || set.size() >> kernels::kSpriteBits != 0) {
    return Refuse("particles", "1 to 2^24 - 1");
  }
  if (!set.radii.empty() || !set.opacities.empty() || !set.colors.empty() ||
      !set.emissions.empty()) {
    return Refuse("particles", "attributes the same for all");
  }
  if (scene.lights.size() != 1 || !std::holds_alternative<DirectionalLight>(scene.lights[0].kind) ||
      scene.lights[0].colored_density()) {
    return Refuse("lights", "one, directional, of one density");
  }
  if (material.profile != Profile::kSoft) return Refuse("material.profile", "soft");
  if (material.phase_g != 0.0F || scene.scatters()) return Refuse("material", "no scattering");
  if (-std::log1p(-static_cast<double>(material.opacity)) > kMostOpticalDepth) {
    return Refuse("material.opacity", "optical depths up to 1.5");
  }
  if (!std::holds_alternative<Perspective>(camera.projection) ||
      camera.window.width != camera.width || camera.window.height != camera.height) {
    return Refuse("camera", "a whole perspective image");
  }
  if (scene.time_offset_s != 0.0 || scene.sampling != Sampling{}) {
    return Refuse("scene", "no time offset, one sample a pixel");
  }
  return absl::OkStatus();
}

void SetAxis(const glm::dvec3& axis, const glm::dvec3& from, float (&row)[4]) {
  for (int i = 0; i < 3; ++i) row[i] = static_cast<float>(axis[i]);
  row[3] = static_cast<float>(glm::dot(axis, from));
}

// Offsets from the set's origin to the eye's and the light's coordinates.
kernels::Views ViewsOf(const Scene& scene) {
  kernels::Views views{};
  const glm::dmat4& view = scene.camera.view_from_world;
  const glm::dvec4 origin(scene.particles->origin, 1.0);
  for (int i = 0; i < 3; ++i) {
    const glm::dvec4 row = glm::row(view, i) * (i == 2 ? -1.0 : 1.0);
    SetAxis(glm::dvec3(row), glm::dvec3(0.0), views.eye[i]);
    views.eye[i][3] = static_cast<float>(glm::dot(row, origin));
  }
  const glm::dvec3 along = std::get<DirectionalLight>(scene.lights[0].kind).direction;
  const glm::dvec3 beside = std::abs(along.y) > 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 right = glm::normalize(glm::cross(along, beside));
  SetAxis(right, glm::dvec3(0.0), views.light[0]);
  SetAxis(glm::cross(along, right), glm::dvec3(0.0), views.light[1]);
  SetAxis(along, glm::dvec3(0.0), views.light[2]);
  return views;
}

kernels::Lens LensOf(const Scene& scene) {
  const Camera& camera = scene.camera;
  const double fov = std::get<Perspective>(camera.projection).vertical_fov;
  return {.center_x = 0.5F * static_cast<float>(camera.width),
          .center_y = 0.5F * static_cast<float>(camera.height),
          .pixels_per_slope = static_cast<float>(0.5 * camera.height / std::tan(0.5 * fov)),
          .radius = scene.material.radius,
          .width = camera.width,
          .height = camera.height};
}

kernels::Look LookOf(const Scene& scene) {
  const Material& material = scene.material;
  const Light& light = scene.lights[0];
  kernels::Look look{};
  for (int c = 0; c < 3; ++c) {
    look.dark[c] = material.albedo[c] * material.ambient[c] + material.emission[c];
    look.lit[c] = material.albedo[c] * light.color[c];
  }
  look.density = light.shadow_density.x;
  return look;
}

template <typename Visit>
void ForTiles(const Rect& rect, size_t tiles_across, const Visit& visit) {
  if (rect.x_begin >= rect.x_end) return;
  for (int y = rect.y_begin / kernels::kTile; y * kernels::kTile < rect.y_end; ++y) {
    for (int x = rect.x_begin / kernels::kTile; x * kernels::kTile < rect.x_end; ++x) {
      visit(static_cast<size_t>(y) * tiles_across + static_cast<size_t>(x), y);
    }
  }
}

}  // namespace

struct Yardstick::Buffers {
  // By particle.
  std::vector<float> x, y, z, right, down, depth;
  std::vector<uint32_t> eye_key, light_key;
  // By place from the light, and from the eye.
  std::vector<uint32_t> light_order, eye_order;
  std::vector<float> columns, rows;
  std::vector<kernels::Sprite> sprites;
  std::vector<Rect> rects;
  std::array<std::vector<Keyed>, 4> keyed;
  // By thread.
  std::vector<kernels::Bounds> bounds;
  std::vector<std::vector<float>> weights, depths;  // by place from the light
  std::vector<std::vector<uint32_t>> next;          // by tile
  // The light buffer; tiles; what they list.
  std::vector<float> light_buffer;
  std::vector<uint32_t> tile_begin, entries;

  void Resize(size_t count, size_t threads) {
    for (auto* floats : {&x, &y, &z, &right, &down, &depth, &columns, &rows}) floats->resize(count);
    for (auto* words : {&eye_key, &light_key, &light_order, &eye_order}) words->resize(count);
    for (auto& pairs : keyed) pairs.resize(count);
    sprites.resize(count);
    rects.resize(count);
    bounds.resize(threads);
    weights.resize(threads);
    depths.resize(threads);
    next.resize(threads);
    for (size_t t = 0; t < threads; ++t) {
      weights[t].resize(count);
      depths[t].resize(count);
    }
  }

  [[nodiscard]] kernels::Placed placed() {
    return {x.data(),    y.data(),       z.data(),        right.data(),
            down.data(), eye_key.data(), light_key.data()};
  }
};

namespace {

// What all threads of a frame see. They run the same stages, and wait for one another after each.
class Team {
 public:
  explicit Team(size_t threads) : threads_(threads), barrier_(static_cast<ptrdiff_t>(threads)) {}

  [[nodiscard]] size_t threads() const { return threads_; }

  // Runs `work(thread)` on every thread.
  template <typename Work>
  void Run(const Work& work) {
    last_ = Clock::now();
    std::vector<std::jthread> others;
    for (size_t t = 1; t < threads_; ++t) others.emplace_back([&work, t] { work(t); });
    work(0);
  }

  void Wait() { barrier_.arrive_and_wait(); }
  // The same, at the end of a stage.
  void EndStage(size_t thread, const char* stage) {
    next_job_ = 0;
    Wait();
    if (thread != 0) return;
    const auto now = Clock::now();
    timings_.push_back({stage, std::chrono::duration<double, std::milli>(now - last_).count()});
    last_ = now;
  }

  // Of this thread, [begin, end) of `count`.
  [[nodiscard]] std::pair<size_t, size_t> Share(size_t thread, size_t count) const {
    return {count * thread / threads_, count * (thread + 1) / threads_};
  }
  // The next of this stage's jobs that no thread has begun.
  size_t TakeJob() { return next_job_++; }

  std::vector<StageTiming> timings() && { return std::move(timings_); }

 private:
  using Clock = std::chrono::steady_clock;

  size_t threads_;
  std::barrier<> barrier_;
  std::atomic<size_t> next_job_ = 0;
  Clock::time_point last_;
  std::vector<StageTiming> timings_;
};

}  // namespace

Yardstick::Yardstick() : buffers_(std::make_unique<Buffers>()) {}
Yardstick::Yardstick(Yardstick&&) noexcept = default;
Yardstick& Yardstick::operator=(Yardstick&&) noexcept = default;
Yardstick::~Yardstick() = default;

bool Yardstick::Runs() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }

namespace {

// Rows of the light buffer from which each thread's begin, so that all have as many particles.
std::vector<int> SplitRows(std::span<const float> rows, size_t size, size_t threads) {
  std::vector<size_t> count(size);
  for (const float row : rows) ++count[std::min(static_cast<size_t>(row), size - 1)];
  std::vector<int> begin = {0};
  size_t sum = 0;
  for (size_t row = 0; row < size && begin.size() < threads; ++row) {
    sum += count[row];
    if (sum * threads >= begin.size() * rows.size()) begin.push_back(static_cast<int>(row + 1));
  }
  begin.resize(threads + 1, static_cast<int>(size));
  return begin;
}

}  // namespace

absl::StatusOr<FrameResult> Yardstick::Draw(const FrameRequest& request) {
  if (!Runs()) return absl::UnimplementedError("yardstick: needs a CPU with AVX2 and FMA");
  if (absl::Status status = CheckRequest(request); !status.ok()) return status;
  const Scene& scene = request.scene;
  const std::vector<glm::vec3>& positions = scene.particles->positions;
  const size_t count = positions.size();
  const kernels::Views views = ViewsOf(scene);
  const kernels::Lens lens = LensOf(scene);
  const kernels::Look look = LookOf(scene);
  const double tau = -std::log1p(-static_cast<double>(scene.material.opacity));
  const kernels::Opacity opacity = OpacityOf(tau);
  const auto light_size = static_cast<size_t>(scene.shadow.light_buffer_size);
  const size_t across = (static_cast<size_t>(lens.width) + kernels::kTile - 1) / kernels::kTile;
  const size_t down = (static_cast<size_t>(lens.height) + kernels::kTile - 1) / kernels::kTile;
  const size_t tiles = across * down;

  Team team(std::max(1U, std::thread::hardware_concurrency()));
  Buffers& b = *buffers_;
  b.Resize(count, team.threads());
  const kernels::Placed placed = b.placed();
  FrameResult result;
  result.images = {{lens.width, lens.height, 1, {"R", "G", "B", "A"}, {}}};
  std::vector<float>& pixels = result.images[0].pixels;

  // Set between stages, by the first thread.
  kernels::Bounds bounds;
  kernels::LightBuffer light{};
  std::vector<int> band;
  std::atomic<bool> reaches_eye = false;

  team.Run([&](size_t thread) {
    const auto [begin, end] = team.Share(thread, count);
    b.bounds[thread] = kernels::Project(&positions[0].x, begin, end, views, placed);
    team.EndStage(thread, "project");

    for (size_t job = team.TakeJob(); job < 3; job = team.TakeJob()) {
      if (job == 0) SortByKey(b.light_key, b.keyed[0], b.keyed[1], b.light_order.data());
      if (job == 1) SortByKey(b.eye_key, b.keyed[2], b.keyed[3], b.eye_order.data());
      if (job == 2) pixels.resize(static_cast<size_t>(lens.width) * lens.height * 4);
    }
    team.EndStage(thread, "sort and clear");

    if (thread == 0) {
      for (const kernels::Bounds& part : b.bounds) {
        bounds.least_z = std::min(bounds.least_z, part.least_z);
        bounds.right[0] = std::min(bounds.right[0], part.right[0]);
        bounds.right[1] = std::max(bounds.right[1], part.right[1]);
        bounds.down[0] = std::min(bounds.down[0], part.down[0]);
        bounds.down[1] = std::max(bounds.down[1], part.down[1]);
      }
      reaches_eye = bounds.least_z <= 2.0F * lens.radius;
      light.stride = light_size + 2 * kernels::kTile;
      b.light_buffer.assign(light_size * light.stride, 0.0F);
      light.depth = b.light_buffer.data();
      const float size = static_cast<float>(light_size);
      light.radius_columns =
          lens.radius * size / (bounds.right[1] - bounds.right[0] + 2.0F * lens.radius);
      light.radius_rows =
          lens.radius * size / (bounds.down[1] - bounds.down[0] + 2.0F * lens.radius);
      light.optical_depth = static_cast<float>(tau);
    }
    team.Wait();
    const float columns_per_unit = light.radius_columns / lens.radius;
    const float rows_per_unit = light.radius_rows / lens.radius;
    for (size_t place = begin; place < end; ++place) {
      const uint32_t i = b.light_order[place];
      b.columns[place] = light.radius_columns + (b.right[i] - bounds.right[0]) * columns_per_unit;
      b.rows[place] = light.radius_rows + (b.down[i] - bounds.down[0]) * rows_per_unit;
    }
    team.Wait();
    if (thread == 0) band = SplitRows(b.rows, light_size, team.threads());
    team.Wait();
    kernels::Sweep(light, band[thread], band[thread + 1], b.columns.data(), b.rows.data(), count,
                   b.weights[thread].data(), b.depths[thread].data());
    team.Wait();
    for (size_t place = begin; place < end; ++place) {
      float weight = 0.0F;
      float depth = 0.0F;
      for (size_t t = 0; t < team.threads(); ++t) {
        weight += b.weights[t][place];
        depth += b.depths[t][place];
      }
      b.depth[b.light_order[place]] = weight > 0.0F ? depth / weight : 0.0F;
    }
    team.EndStage(thread, "light");

    kernels::Shade(b.eye_order.data(), begin, end, placed, b.depth.data(), lens, look,
                   b.sprites.data(), b.rects.data());
    team.EndStage(thread, "shade");

    std::vector<uint32_t>& next = b.next[thread];
    next.assign(tiles, 0);
    for (size_t i = begin; i < end; ++i) {
      ForTiles(b.rects[i], across, [&](size_t tile, int) { ++next[tile]; });
    }
    team.Wait();
    if (thread == 0) {
      b.tile_begin.resize(tiles + 1);
      uint32_t sum = 0;
      for (size_t tile = 0; tile < tiles; ++tile) {
        b.tile_begin[tile] = sum;
        for (std::vector<uint32_t>& of_thread : b.next) {
          sum += std::exchange(of_thread[tile], sum);
        }
      }
      b.tile_begin[tiles] = sum;
      if (b.entries.size() < sum) b.entries.resize(sum);
    }
    team.Wait();
    for (size_t i = begin; i < end; ++i) {
      const Rect& rect = b.rects[i];
      ForTiles(rect, across, [&](size_t tile, int tile_row) {
        const int top = tile_row * kernels::kTile;
        const int first = std::max(rect.y_begin - top, 0);
        const int last = std::min(rect.y_end - top, kernels::kTile) - 1;
        b.entries[next[tile]++] = kernels::EntryOf(
            static_cast<uint32_t>(i), static_cast<uint32_t>(first), static_cast<uint32_t>(last));
      });
    }
    team.EndStage(thread, "bin");

    for (size_t tile = team.TakeJob(); tile < tiles; tile = team.TakeJob()) {
      const uint32_t tile_begin = b.tile_begin[tile];
      const uint32_t tile_end = b.tile_begin[tile + 1];
      if (tile_begin == tile_end) continue;
      kernels::Composite(&b.entries[tile_begin], tile_end - tile_begin, b.sprites.data(), opacity,
                         lens, static_cast<int>(tile % across) * kernels::kTile,
                         static_cast<int>(tile / across) * kernels::kTile, kEnough, pixels.data());
    }
    team.EndStage(thread, "composite");
  });
  if (reaches_eye) return Refuse("camera", "no particle near the eye");
  result.timings = std::move(team).timings();
  return result;
}

}  // namespace halflight::bench
