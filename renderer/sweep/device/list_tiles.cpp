// Entries by place, sorted by tile, in compute.
#include <algorithm>
#include <bit>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "renderer/passes/prefix_sum.h"
#include "renderer/passes/sort_keys.h"
#include "renderer/sweep/device/lists.h"
#include "shaders/bindings.h"
#include "spirv/tile_begins.comp.h"
#include "spirv/tile_counts.comp.h"
#include "spirv/tile_entries.comp.h"

namespace halflight::sweep {

namespace {

// Rectangles between places at which a binding may begin.
constexpr size_t kAlignedPlaces = 256 / sizeof(glm::uvec2);

const gl::ProgramSource& CountsProgram() {
  static const gl::ProgramSource source{"tile counts",
                                        {{GL_COMPUTE_SHADER, spirv_tile_counts_comp}}};
  return source;
}

const gl::ProgramSource& EntriesProgram() {
  static const gl::ProgramSource source{"tile entries",
                                        {{GL_COMPUTE_SHADER, spirv_tile_entries_comp}}};
  return source;
}

const gl::ProgramSource& BeginsProgram() {
  static const gl::ProgramSource source{"tile begins",
                                        {{GL_COMPUTE_SHADER, spirv_tile_begins_comp}}};
  return source;
}

// Runs a program with what is bound and this block.
absl::Status Run(Gpu& gpu, const gl::ProgramSource& source, const shader::TilesBlock& block,
                 size_t invocations) {
  const absl::StatusOr<GLuint> program = gpu.programs.Get(source, {});
  if (!program.ok()) return program.status();
  const gl::Buffer uniforms = gl::MakeBlock("tiles", block);
  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kTilesBinding, uniforms.name());
  gl::DispatchGroups(gl::DivideUp(invocations, shader::kListGroupSize));
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  return absl::OkStatus();
}

// Binds the rectangles of the run from the nearest place before it at which a binding may begin.
void BindRects(const gl::Buffer& rects, const PlaceRun& run, shader::TilesBlock& block) {
  const size_t first = run.first / kAlignedPlaces * kAlignedPlaces;
  block.run = {run.first - first, run.end - run.first, run.first, 0U};
  gl::BindStorage(shader::kTileRectsBinding, rects, sizeof(glm::uvec2), {first, run.end - first});
}

}  // namespace

absl::StatusOr<DeviceTiles> ListDeviceTiles(Gpu& gpu, const gl::Buffer& rects, const PlaceRun& run,
                                            const glm::ivec2& target_size, int tile_size,
                                            std::optional<size_t> entry_count) {
  const gl::DebugScope scope("list tiles");
  const size_t places = run.end - run.first;
  DeviceTiles lists;
  lists.tile_size = tile_size;
  lists.tiles = (target_size + (tile_size - 1)) / tile_size;
  const auto tile_count = static_cast<size_t>(lists.tiles.x) * static_cast<size_t>(lists.tiles.y);
  lists.begin = gl::MakeBuffer("tile begins", (tile_count + 1) * sizeof(uint32_t));
  shader::TilesBlock block;
  block.tiles = {lists.tiles, tile_size, 0};
  block.entries = glm::uvec4(0U);
  if (places == 0) {
    glClearNamedBufferData(lists.begin.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
    lists.entries = gl::MakeBuffer("tile entries", size_t{0});
    return lists;
  }
  if (absl::Status status = gl::CheckStorageBlock("rectangles of a run of particles",
                                                  (places + kAlignedPlaces) * sizeof(glm::uvec2));
      !status.ok()) {
    return status;
  }

  // Count.
  const gl::Buffer begins = gl::MakeBuffer("entry begins", (places + 1) * sizeof(uint32_t));
  BindRects(rects, run, block);
  gl::BindStorage(shader::kEntryBeginsBinding, begins);
  if (absl::Status status = Run(gpu, CountsProgram(), block, places); !status.ok()) return status;

  // Sum; the total sizes what follows.
  if (absl::Status status = PrefixSum(gpu, begins, places, begins); !status.ok()) return status;
  lists.entry_count = entry_count ? *entry_count : gl::ReadWord(begins, places);
  const size_t bytes = lists.entry_count * sizeof(uint32_t);
  if (absl::Status status = gl::CheckStorageBlock("tile entries of a run of particles", bytes);
      !status.ok()) {
    return status;
  }
  block.entries.x = static_cast<uint32_t>(lists.entry_count);

  // Write entries by place, and sort them by tile.
  KeyedValues entries{gl::MakeBuffer("entry tiles", bytes), gl::MakeBuffer("entry places", bytes)};
  BindRects(rects, run, block);
  gl::BindStorage(shader::kEntryBeginsBinding, begins);
  gl::BindStorage(shader::kEntryTilesBinding, entries.keys);
  gl::BindStorage(shader::kEntryPlacesBinding, entries.values);
  if (absl::Status status = Run(gpu, EntriesProgram(), block, lists.entry_count); !status.ok()) {
    return status;
  }
  const int tile_bits = std::max(static_cast<int>(std::bit_width(tile_count - 1)), 1);
  absl::StatusOr<KeyedValues> sorted =
      SortKeys(gpu, std::move(entries), lists.entry_count, tile_bits);
  if (!sorted.ok()) return sorted.status();

  // Find where tiles begin.
  gl::BindStorage(shader::kTileRectsBinding, rects);
  gl::BindStorage(shader::kEntryTilesBinding, sorted->keys);
  gl::BindStorage(shader::kTileBeginsBinding, lists.begin);
  if (absl::Status status = Run(gpu, BeginsProgram(), block, tile_count + 1); !status.ok()) {
    return status;
  }
  lists.entries = std::move(sorted->values);
  return lists;
}

}  // namespace halflight::sweep
