#include "renderer/passes/prefix_sum.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "shaders/bindings.h"
#include "spirv/block_sums.comp.h"
#include "spirv/prefix_sum.comp.h"

namespace halflight {

namespace {

constexpr size_t kMaxValues = size_t{1} << 28U;
// What one workgroup sums: a multiple of 256 bytes, so that parts may begin at any block.
constexpr size_t kBlock = size_t{shader::kScanGroupSize} * shader::kScanPerInvocation;

const gl::ProgramSource& BlockSumsProgram() {
  static const gl::ProgramSource source{"block sums", {{GL_COMPUTE_SHADER, spirv_block_sums_comp}}};
  return source;
}

const gl::ProgramSource& PrefixSumProgram() {
  static const gl::ProgramSource source{"prefix sum", {{GL_COMPUTE_SHADER, spirv_prefix_sum_comp}}};
  return source;
}

struct ScanPrograms {
  GLuint block_sums;
  GLuint prefix_sum;
};

// Runs a program over the blocks of count + 1 sums, the last of which has no value, in parts that a
// storage block holds.
void RunOverBlocks(GLuint program, const gl::Buffer& values, size_t count,
                   const gl::Buffer& block_sums, const gl::Buffer* sums) {
  glUseProgram(program);
  gl::BindStorage(shader::kScanBlockSumsBinding, block_sums);
  const size_t part =
      std::max<size_t>(gl::StorageBlockLimit() / sizeof(uint32_t) / kBlock, 1) * kBlock;
  for (size_t first = 0; first <= count; first += part) {
    const size_t part_sums = std::min(part, count + 1 - first);
    const size_t part_values = std::min(part, count - first);
    if (part_values > 0) {
      gl::BindStorage(shader::kScanValuesBinding, values, sizeof(uint32_t), {first, part_values});
    } else {
      gl::BindStorage(shader::kScanValuesBinding, values);
    }
    if (sums != nullptr) {
      gl::BindStorage(shader::kScanPrefixBinding, *sums, sizeof(uint32_t), {first, part_sums});
    }
    const size_t blocks = gl::DivideUp(part_sums, kBlock);
    shader::ScanBlock block;
    block.count = {part_values, part_sums, 0U, 0U};
    block.blocks = {blocks, first / kBlock, 0U, 0U};
    const gl::Buffer uniforms = gl::MakeBlock("part of a prefix sum", block);
    glBindBufferBase(GL_UNIFORM_BUFFER, shader::kScanBinding, uniforms.name());
    gl::DispatchGroups(blocks);
  }
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

// Reduces to a sum a block, sums those up in the same way, and gives each block what came before.
void Scan(const ScanPrograms& programs, const gl::Buffer& values, size_t count,
          const gl::Buffer& sums) {
  const size_t blocks = gl::DivideUp(count + 1, kBlock);
  const gl::Buffer block_sums = gl::MakeBuffer("block sums", blocks * sizeof(uint32_t));
  if (blocks > 1) {
    RunOverBlocks(programs.block_sums, values, count, block_sums, nullptr);
    // What the last block sums to comes before no other.
    Scan(programs, block_sums, blocks - 1, block_sums);
  } else {
    glClearNamedBufferData(block_sums.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  }
  RunOverBlocks(programs.prefix_sum, values, count, block_sums, &sums);
}

}  // namespace

absl::Status PrefixSum(Gpu& gpu, const gl::Buffer& values, size_t count, const gl::Buffer& sums) {
  const gl::DebugScope scope("prefix sum");
  if (count > kMaxValues) {
    return absl::InvalidArgumentError(
        absl::StrCat("prefix sum of ", count, " values, allowed: at most ", kMaxValues));
  }
  const absl::StatusOr<GLuint> block_sums = gpu.programs.Get(BlockSumsProgram(), {});
  if (!block_sums.ok()) return block_sums.status();
  const absl::StatusOr<GLuint> prefix_sum = gpu.programs.Get(PrefixSumProgram(), {});
  if (!prefix_sum.ok()) return prefix_sum.status();
  Scan({*block_sums, *prefix_sum}, values, count, sums);
  return absl::OkStatus();
}

}  // namespace halflight
