#include "renderer/sweep/device/runs.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "spirv/count_squares.comp.h"

namespace halflight::sweep {

namespace {

constexpr size_t kGroup = shader::kScanGroupSize;

const gl::ProgramSource& CountSquaresProgram() {
  static const gl::ProgramSource source{"count squares",
                                        {{GL_COMPUTE_SHADER, spirv_count_squares_comp}}};
  return source;
}

gl::Buffer BindBlock(const glm::uvec4& run) {
  shader::PlaceRunBlock block;
  block.run = run;
  gl::Buffer buffer = gl::MakeBlock("run of places", block);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kPlaceRunBinding, buffer.name());
  return buffer;
}

// Squares of a grid that particles touch.
struct SquareCounts {
  gl::Buffer offsets;  // uint by place: of those before it in its group
  gl::Buffer groups;   // uint by group: of all of it
};

absl::StatusOr<SquareCounts> CountSquares(Gpu& gpu, const DeviceSprites& sprites, int square) {
  const absl::StatusOr<GLuint> program = gpu.programs.Get(CountSquaresProgram(), {});
  if (!program.ok()) return program.status();
  const size_t groups = gl::DivideUp(sprites.count, kGroup);
  SquareCounts counts{gl::MakeBuffer("square offsets", sprites.count * sizeof(uint32_t)),
                      gl::MakeBuffer("squares of groups", groups * sizeof(uint32_t))};
  glUseProgram(*program);
  const gl::Buffer block = BindBlock({0U, sprites.count, square, 0U});
  gl::BindStorage(shader::kLightRectsBinding, sprites.rects);
  gl::BindStorage(shader::kPatchOffsetsBinding, counts.offsets);
  gl::BindStorage(shader::kGroupOffsetsBinding, counts.groups);
  gl::DispatchGroups(groups);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  return counts;
}

std::vector<uint32_t> Read(const gl::Buffer& buffer, size_t first, size_t count) {
  std::vector<uint32_t> words(count);
  glGetNamedBufferSubData(buffer.name(), static_cast<GLintptr>(first * sizeof(uint32_t)),
                          static_cast<GLsizeiptr>(count * sizeof(uint32_t)), words.data());
  return words;
}

// Of the places of a group, and after the last that of all.
std::vector<uint32_t> ReadOffsets(const SquareCounts& counts, size_t first, size_t places,
                                  uint32_t all) {
  std::vector<uint32_t> offsets = Read(counts.offsets, first, places);
  offsets.push_back(all);
  return offsets;
}

// Appends places to the last run, or begins another.
void Append(size_t places, size_t texels, size_t entries, const PatchRunLimits& limits,
            std::vector<PatchRun>& runs) {
  if (runs.empty()) runs.push_back({});
  const PatchRun& last = runs.back();
  const size_t end = last.places.end;
  const bool holds = last.texels + texels <= limits.texels &&
                     last.entries + entries <= limits.entries &&
                     end + places - last.places.first <= limits.places;
  if (!holds && end > last.places.first) {
    runs.push_back({{end, end}, 0, 0, last.texels_before + static_cast<uint32_t>(last.texels)});
  }
  runs.back().places.end += places;
  runs.back().texels += texels;
  runs.back().entries += entries;
}

size_t MostEntries(size_t wanted) {
  return std::min(wanted, gl::StorageBlockLimit() / sizeof(uint32_t));
}

}  // namespace

gl::Buffer BindRun(const PatchRun& run, int light_buffer_size) {
  return BindBlock({run.places.first, run.places.end, light_buffer_size, run.texels_before});
}

absl::StatusOr<PatchRuns> CutIntoPatchRuns(Gpu& gpu, const DeviceSprites& sprites, int tile_size,
                                           const PatchRunLimits& wanted) {
  const PatchRunLimits limits{std::min(wanted.texels, gl::StorageBlockLimit() / sizeof(float)),
                              wanted.places, MostEntries(wanted.entries)};
  const gl::DebugScope scope("patch runs");
  PatchRuns patches;
  if (sprites.count == 0) return patches;

  // Count both before either is waited for.
  absl::StatusOr<SquareCounts> texels = CountSquares(gpu, sprites, 1);
  if (!texels.ok()) return texels.status();
  const absl::StatusOr<SquareCounts> entries = CountSquares(gpu, sprites, tile_size);
  if (!entries.ok()) return entries.status();
  const size_t groups = gl::DivideUp(sprites.count, kGroup);
  const std::vector<uint32_t> group_texels = Read(texels->groups, 0, groups);
  const std::vector<uint32_t> group_entries = Read(entries->groups, 0, groups);

  // Cut between groups, or within those that are too large: only below kMaxPatchTexels do they tell
  // what every particle has.
  const size_t most_of_group = std::min<size_t>(limits.texels, shader::kMaxPatchTexels);
  std::vector<uint32_t> group_offsets;
  group_offsets.reserve(groups);
  uint32_t before = 0;
  for (size_t group = 0; group < groups; ++group) {
    const size_t first = group * kGroup;
    const size_t places = std::min(kGroup, sprites.count - first);
    if (group_texels[group] <= most_of_group && group_entries[group] <= limits.entries &&
        places <= limits.places) {
      Append(places, group_texels[group], group_entries[group], limits, patches.runs);
    } else {
      const auto texel = ReadOffsets(*texels, first, places, group_texels[group]);
      const auto entry = ReadOffsets(*entries, first, places, group_entries[group]);
      for (size_t k = 0; k < places; ++k) {
        const uint32_t covered = texel[k + 1] - texel[k];
        if (covered > shader::kMaxPatchTexels) {
          return absl::ResourceExhaustedError(absl::StrCat(
              "shadow.light_buffer_size: a particle covers more than ", shader::kMaxPatchTexels,
              " texels, allowed on this device: at most that many"));
        }
        Append(1, covered, entry[k + 1] - entry[k], limits, patches.runs);
      }
    }
    group_offsets.push_back(before);
    before += group_texels[group];
  }
  patches.offsets = std::move(texels->offsets);
  patches.group_offsets = gl::MakeBuffer("patch offsets of groups", group_offsets);
  return patches;
}

absl::StatusOr<std::vector<ListedRun>> CutIntoListedRuns(Gpu& gpu, const DeviceSprites& sprites,
                                                         int tile_size, size_t most_places) {
  const gl::DebugScope scope("listed runs");
  std::vector<ListedRun> runs;
  if (sprites.count == 0) return runs;
  const absl::StatusOr<SquareCounts> entries = CountSquares(gpu, sprites, tile_size);
  if (!entries.ok()) return entries.status();
  const size_t groups = gl::DivideUp(sprites.count, kGroup);
  const std::vector<uint32_t> group_entries = Read(entries->groups, 0, groups);
  const size_t most_entries = MostEntries(kMostRunEntries);
  for (size_t group = 0; group < groups; ++group) {
    const size_t first = group * kGroup;
    const size_t end = std::min(first + kGroup, sprites.count);
    if (group_entries[group] > most_entries) {
      return absl::ResourceExhaustedError(
          absl::StrCat("tile lists of ", end - first, " particles: ", group_entries[group],
                       " entries, allowed on this device: ", most_entries));
    }
    const bool holds = !runs.empty() &&
                       runs.back().entries + group_entries[group] <= most_entries &&
                       end - runs.back().places.first <= most_places;
    if (!holds) runs.push_back({{first, first}, 0});
    runs.back().places.end = end;
    runs.back().entries += group_entries[group];
  }
  return runs;
}

}  // namespace halflight::sweep
