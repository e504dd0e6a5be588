#include "renderer/sweep/device/patch_runs.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "spirv/patch_offsets.comp.h"

namespace halflight::sweep {

namespace {

constexpr size_t kGroup = shader::kScanGroupSize;

const gl::ProgramSource& PatchOffsetsProgram() {
  static const gl::ProgramSource source{"patch offsets",
                                        {{GL_COMPUTE_SHADER, spirv_patch_offsets_comp}}};
  return source;
}

// Appends places to the last run, or begins another.
void Append(size_t places, size_t texels, const PatchRunLimits& limits,
            std::vector<PatchRun>& runs) {
  if (runs.empty()) runs.push_back({});
  const PatchRun& last = runs.back();
  const size_t end = last.places.end;
  const bool holds =
      last.texels + texels <= limits.texels && end + places - last.places.first <= limits.places;
  if (!holds && end > last.places.first) {
    runs.push_back({{end, end}, 0, last.texels_before + static_cast<uint32_t>(last.texels)});
  }
  runs.back().places.end += places;
  runs.back().texels += texels;
}

std::vector<uint32_t> Read(const gl::Buffer& buffer, size_t first, size_t count) {
  std::vector<uint32_t> words(count);
  glGetNamedBufferSubData(buffer.name(), static_cast<GLintptr>(first * sizeof(uint32_t)),
                          static_cast<GLsizeiptr>(count * sizeof(uint32_t)), words.data());
  return words;
}

}  // namespace

gl::Buffer BindRun(const PatchRun& run, int light_buffer_size) {
  shader::PlaceRunBlock block;
  block.run = {run.places.first, run.places.end, light_buffer_size, run.texels_before};
  gl::Buffer buffer = gl::MakeBlock("run of places", block);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kPlaceRunBinding, buffer.name());
  return buffer;
}

absl::StatusOr<PatchRuns> CutIntoPatchRuns(Gpu& gpu, const DeviceSprites& sprites,
                                           const PatchRunLimits& wanted) {
  const PatchRunLimits limits{std::min(wanted.texels, gl::StorageBlockLimit() / sizeof(float)),
                              wanted.places};
  const gl::DebugScope scope("patch runs");
  PatchRuns patches;
  if (sprites.count == 0) return patches;
  const absl::StatusOr<GLuint> program = gpu.programs.Get(PatchOffsetsProgram(), {});
  if (!program.ok()) return program.status();

  // Count texels.
  const size_t groups = gl::DivideUp(sprites.count, kGroup);
  patches.offsets = gl::MakeBuffer("patch offsets", sprites.count * sizeof(uint32_t));
  const gl::Buffer texels = gl::MakeBuffer("texels of groups", groups * sizeof(uint32_t));
  glUseProgram(*program);
  const gl::Buffer all = BindRun({{0, sprites.count}}, 0);
  gl::BindStorage(shader::kLightRectsBinding, sprites.rects);
  gl::BindStorage(shader::kPatchOffsetsBinding, patches.offsets);
  gl::BindStorage(shader::kGroupOffsetsBinding, texels);
  gl::DispatchGroups(groups);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);

  // Cut between groups, or within those that are too large: only below kMaxPatchTexels do they tell
  // what every particle has.
  const size_t most_of_group = std::min<size_t>(limits.texels, shader::kMaxPatchTexels);
  std::vector<uint32_t> group_offsets;
  group_offsets.reserve(groups);
  uint32_t before = 0;
  const std::vector<uint32_t> group_texels = Read(texels, 0, groups);
  for (size_t group = 0; group < groups; ++group) {
    const size_t first = group * kGroup;
    const size_t places = std::min(kGroup, sprites.count - first);
    if (group_texels[group] <= most_of_group && places <= limits.places) {
      Append(places, group_texels[group], limits, patches.runs);
    } else {
      std::vector<uint32_t> offsets = Read(patches.offsets, first, places);
      offsets.push_back(group_texels[group]);
      for (size_t k = 0; k < places; ++k) {
        const uint32_t covered = offsets[k + 1] - offsets[k];
        if (covered > shader::kMaxPatchTexels) {
          return absl::ResourceExhaustedError(absl::StrCat(
              "shadow.light_buffer_size: a particle covers more than ", shader::kMaxPatchTexels,
              " texels, allowed on this device: at most that many"));
        }
        Append(1, covered, limits, patches.runs);
      }
    }
    group_offsets.push_back(before);
    before += group_texels[group];
  }
  patches.group_offsets = gl::MakeBuffer("patch offsets of groups", group_offsets);
  return patches;
}

}  // namespace halflight::sweep
