#include "renderer/passes/sort_keys.h"

#include <utility>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "renderer/passes/prefix_sum.h"
#include "shaders/bindings.h"
#include "spirv/sort_count.comp.h"
#include "spirv/sort_scatter.comp.h"

namespace halflight {

namespace {

constexpr size_t kDigits = shader::kSortGroupSize;
constexpr uint32_t kDigitBits = 8;
static_assert(kDigits == 1U << kDigitBits);
constexpr size_t kBlock = size_t{shader::kSortGroupSize} * shader::kSortRounds;

const gl::ProgramSource& CountProgram() {
  static const gl::ProgramSource source{"sort count", {{GL_COMPUTE_SHADER, spirv_sort_count_comp}}};
  return source;
}

const gl::ProgramSource& ScatterProgram() {
  static const gl::ProgramSource source{"sort scatter",
                                        {{GL_COMPUTE_SHADER, spirv_sort_scatter_comp}}};
  return source;
}

// Sorts by the digit that begins at bit `shift`.
absl::Status SortByDigit(Gpu& gpu, const KeyedValues& items, size_t count, uint32_t shift,
                         const KeyedValues& sorted) {
  const absl::StatusOr<GLuint> count_program = gpu.programs.Get(CountProgram(), {});
  if (!count_program.ok()) return count_program.status();
  const absl::StatusOr<GLuint> scatter_program =
      gpu.programs.Get(ScatterProgram(), {{shader::kNumberItemsConstant, !items.values}});
  if (!scatter_program.ok()) return scatter_program.status();

  const size_t blocks = gl::DivideUp(count, kBlock);
  shader::SortBlock block;
  block.pass = {count, shift, blocks, 0U};
  const gl::Buffer uniforms = gl::MakeBlock("sort pass", block);
  const gl::Buffer table = gl::MakeBuffer("sort table", (kDigits * blocks + 1) * sizeof(uint32_t));

  // Count.
  glUseProgram(*count_program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kSortBinding, uniforms.name());
  gl::BindStorage(shader::kSortKeysBinding, items.keys);
  gl::BindStorage(shader::kSortTableBinding, table);
  gl::DispatchGroups(blocks);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);

  // Sum.
  if (absl::Status status = PrefixSum(gpu, table, kDigits * blocks, table); !status.ok()) {
    return status;
  }

  // Scatter.
  glUseProgram(*scatter_program);
  gl::BindStorage(shader::kSortKeysBinding, items.keys);
  gl::BindStorage(shader::kSortTableBinding, table);
  gl::BindStorage(shader::kSortValuesBinding, items.values ? items.values : items.keys);
  gl::BindStorage(shader::kSortedKeysBinding, sorted.keys);
  gl::BindStorage(shader::kSortedValuesBinding, sorted.values);
  gl::DispatchGroups(blocks);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<KeyedValues> SortKeys(Gpu& gpu, KeyedValues items, size_t count, int key_bits) {
  const gl::DebugScope scope("sort keys");
  const size_t bytes = count * sizeof(uint32_t);
  if (absl::Status status = gl::CheckStorageBlock("keys to sort", bytes); !status.ok()) {
    return status;
  }
  const auto make = [&](const char* label) { return gl::MakeBuffer(label, bytes); };
  KeyedValues sorted{make("sorted keys"), make("sorted values")};
  for (uint32_t shift = 0; shift == 0 || shift < static_cast<uint32_t>(key_bits);
       shift += kDigitBits) {
    if (absl::Status status = SortByDigit(gpu, items, count, shift, sorted); !status.ok()) {
      return status;
    }
    std::swap(items, sorted);
    if (!sorted.values) sorted.values = make("sorted values");
  }
  return items;
}

}  // namespace halflight
