#include "tests/bench/yardstick.h"

#include <algorithm>
#include <array>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "tests/bench/team.h"
#include "tests/bench/yardstick_kernels.h"
#include "tests/bench/yardstick_scene.h"

namespace halflight::bench {
namespace {

using kernels::Rect;

// What shines through a tile at most where it is left: as little as the last digit of 8 bits shows.
constexpr float kEnough = 1.0F / 2048.0F;

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

Yardstick::Yardstick() : buffers_(std::make_unique<Buffers>()) {}
Yardstick::Yardstick(Yardstick&&) noexcept = default;
Yardstick& Yardstick::operator=(Yardstick&&) noexcept = default;
Yardstick::~Yardstick() = default;

bool Yardstick::Runs() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }

// One frame: its stages, each run by all threads of a team. What a stage needs of the one before is
// there after Team::EndStage.
class Yardstick::Frame {
 public:
  Frame(const Scene& scene, Buffers& buffers, Team& team, std::vector<float>& pixels)
      : scene_(scene),
        b_(buffers),
        team_(team),
        pixels_(pixels),
        views_(ViewsOf(scene)),
        lens_(LensOf(scene)),
        look_(LookOf(scene)),
        opacity_(OpacityOf(scene)),
        count_(scene.particles->size()),
        light_size_(static_cast<size_t>(scene.shadow.light_buffer_size)),
        across_((static_cast<size_t>(lens_.width) + kernels::kTile - 1) / kernels::kTile),
        tiles_(across_ *
               ((static_cast<size_t>(lens_.height) + kernels::kTile - 1) / kernels::kTile)) {
    b_.Resize(count_, team.threads());
  }

  void Project(size_t thread) {
    const auto [begin, end] = team_.Share(thread, count_);
    b_.bounds[thread] =
        kernels::Project(&scene_.particles->positions[0].x, begin, end, views_, b_.placed());
  }

  // Whether a particle is too near the eye for what follows. Valid after Project.
  [[nodiscard]] bool reaches_eye() const {
    return std::any_of(b_.bounds.begin(), b_.bounds.end(), [&](const kernels::Bounds& part) {
      return part.least_z <= 2.0F * lens_.radius;
    });
  }

  void SortAndClear() {
    for (size_t job = team_.TakeJob(); job < 3; job = team_.TakeJob()) {
      if (job == 0) SortByKey(b_.light_key, b_.keyed[0], b_.keyed[1], b_.light_order.data());
      if (job == 1) SortByKey(b_.eye_key, b_.keyed[2], b_.keyed[3], b_.eye_order.data());
      if (job == 2) pixels_.resize(static_cast<size_t>(lens_.width) * lens_.height * 4);
    }
  }

  // Every thread takes all particles through rows of its own.
  void SweepLight(size_t thread) {
    const auto [begin, end] = team_.Share(thread, count_);
    if (thread == 0) FitLightBuffer();
    team_.Wait();
    const float columns_per_unit = light_.radius_columns / lens_.radius;
    const float rows_per_unit = light_.radius_rows / lens_.radius;
    for (size_t place = begin; place < end; ++place) {
      const uint32_t i = b_.light_order[place];
      b_.columns[place] =
          light_.radius_columns + (b_.right[i] - bounds_.right[0]) * columns_per_unit;
      b_.rows[place] = light_.radius_rows + (b_.down[i] - bounds_.down[0]) * rows_per_unit;
    }
    team_.Wait();
    if (thread == 0) band_ = SplitRows(b_.rows, light_size_, team_.threads());
    team_.Wait();
    kernels::Sweep(light_, band_[thread], band_[thread + 1], b_.columns.data(), b_.rows.data(),
                   count_, b_.weights[thread].data(), b_.depths[thread].data());
    team_.Wait();
    for (size_t place = begin; place < end; ++place) {
      float weight = 0.0F;
      float depth = 0.0F;
      for (size_t t = 0; t < team_.threads(); ++t) {
        weight += b_.weights[t][place];
        depth += b_.depths[t][place];
      }
      b_.depth[b_.light_order[place]] = weight > 0.0F ? depth / weight : 0.0F;
    }
  }

  void Shade(size_t thread) {
    const auto [begin, end] = team_.Share(thread, count_);
    kernels::Shade(b_.eye_order.data(), begin, end, b_.placed(), b_.depth.data(), lens_, look_,
                   b_.sprites.data(), b_.rects.data());
  }

  // Lists of the sprites over each tile, nearest the eye first: count, sum, scatter.
  void Bin(size_t thread) {
    const auto [begin, end] = team_.Share(thread, count_);
    std::vector<uint32_t>& next = b_.next[thread];
    next.assign(tiles_, 0);
    for (size_t i = begin; i < end; ++i) {
      ForTiles(b_.rects[i], across_, [&](size_t tile, int) { ++next[tile]; });
    }
    team_.Wait();
    if (thread == 0) SumTiles();
    team_.Wait();
    for (size_t i = begin; i < end; ++i) {
      const Rect& rect = b_.rects[i];
      ForTiles(rect, across_, [&](size_t tile, int tile_row) {
        const int top = tile_row * kernels::kTile;
        const int first = std::max(rect.y_begin - top, 0);
        const int last = std::min(rect.y_end - top, kernels::kTile) - 1;
        b_.entries[next[tile]++] = kernels::EntryOf(
            static_cast<uint32_t>(i), static_cast<uint32_t>(first), static_cast<uint32_t>(last));
      });
    }
  }

  void Composite() {
    for (size_t tile = team_.TakeJob(); tile < tiles_; tile = team_.TakeJob()) {
      const uint32_t begin = b_.tile_begin[tile];
      const uint32_t end = b_.tile_begin[tile + 1];
      if (begin == end) continue;
      kernels::Composite(&b_.entries[begin], end - begin, b_.sprites.data(), opacity_, lens_,
                         static_cast<int>(tile % across_) * kernels::kTile,
                         static_cast<int>(tile / across_) * kernels::kTile, kEnough,
                         pixels_.data());
    }
  }

 private:
  void FitLightBuffer() {
    for (const kernels::Bounds& part : b_.bounds) {
      bounds_.right[0] = std::min(bounds_.right[0], part.right[0]);
      bounds_.right[1] = std::max(bounds_.right[1], part.right[1]);
      bounds_.down[0] = std::min(bounds_.down[0], part.down[0]);
      bounds_.down[1] = std::max(bounds_.down[1], part.down[1]);
    }
    light_.stride = light_size_ + kernels::kTile;
    b_.light_buffer.assign(light_size_ * light_.stride, 0.0F);
    light_.depth = b_.light_buffer.data();
    const float texels = lens_.radius * static_cast<float>(light_size_);
    light_.radius_columns = texels / (bounds_.right[1] - bounds_.right[0] + 2.0F * lens_.radius);
    light_.radius_rows = texels / (bounds_.down[1] - bounds_.down[0] + 2.0F * lens_.radius);
    light_.optical_depth = static_cast<float>(YardstickOpticalDepth(scene_));
  }

  // Where each tile's list begins, and in it each thread's part.
  void SumTiles() {
    b_.tile_begin.resize(tiles_ + 1);
    uint32_t sum = 0;
    for (size_t tile = 0; tile < tiles_; ++tile) {
      b_.tile_begin[tile] = sum;
      for (std::vector<uint32_t>& of_thread : b_.next) sum += std::exchange(of_thread[tile], sum);
    }
    b_.tile_begin[tiles_] = sum;
    if (b_.entries.size() < sum) b_.entries.resize(sum);
  }

  const Scene& scene_;
  Buffers& b_;
  Team& team_;
  std::vector<float>& pixels_;
  kernels::Views views_;
  kernels::Lens lens_;
  kernels::Look look_;
  kernels::Opacity opacity_;
  size_t count_;
  size_t light_size_;
  size_t across_;  // tiles
  size_t tiles_;
  // Set by the first thread.
  kernels::Bounds bounds_;
  kernels::LightBuffer light_{};
  std::vector<int> band_;  // of rows of the light buffer, by thread
};

absl::StatusOr<FrameResult> Yardstick::Draw(const FrameRequest& request) {
  if (!Runs()) return absl::UnimplementedError("yardstick: needs a CPU with AVX2 and FMA");
  if (absl::Status status = CheckYardstickRequest(request); !status.ok()) return status;
  const Camera& camera = request.scene.camera;
  FrameResult result;
  result.images = {{camera.width, camera.height, 1, {"R", "G", "B", "A"}, {}}};
  Team team(std::max(1U, std::thread::hardware_concurrency()));
  Frame frame(request.scene, *buffers_, team, result.images[0].pixels);
  team.Run([&](size_t thread) {
    frame.Project(thread);
    team.EndStage(thread, "project");
    if (frame.reaches_eye()) return;
    frame.SortAndClear();
    team.EndStage(thread, "sort and clear");
    frame.SweepLight(thread);
    team.EndStage(thread, "light");
    frame.Shade(thread);
    team.EndStage(thread, "shade");
    frame.Bin(thread);
    team.EndStage(thread, "bin");
    frame.Composite();
    team.EndStage(thread, "composite");
  });
  if (frame.reaches_eye()) {
    return absl::InvalidArgumentError(
        "camera: allowed for the yardstick: no particle within two radii of the eye's plane");
  }
  result.timings = std::move(team).timings();
  return result;
}

}  // namespace halflight::bench
