#include "renderer/passes/splat_tiles.h"

#include <algorithm>
#include <span>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "shaders/bindings.h"
#include "spirv/splat_rects.comp.h"

namespace halflight {

namespace {

const gl::ProgramSource& RectsProgram() {
  static const gl::ProgramSource source{"splat rects",
                                        {{GL_COMPUTE_SHADER, spirv_splat_rects_comp}}};
  return source;
}

SplatTiles ListOnCpu(const SplatRects& rects, const sweep::PlaceRun& run, int tile_size) {
  const auto of_run = std::span(rects.on_cpu).subspan(run.first, run.end - run.first);
  const std::vector<sweep::TileRun> runs =
      sweep::CutIntoRuns(of_run, tile_size, {.rects = of_run.size()});
  const size_t count = runs.empty() ? 0 : runs.front().end;
  sweep::TileLists lists = sweep::ListTiles(of_run.first(count), rects.size, tile_size);
  for (uint32_t& entry : lists.entries) entry += static_cast<uint32_t>(run.first);
  return {sweep::UploadTiles(lists), {run.first, run.first + count}};
}

}  // namespace

absl::StatusOr<SplatRects> FindSplatRects(Gpu& gpu, const DeviceInfo& device,
                                          const ParticleBuffers& particles,
                                          const gl::Buffer& splats, const gl::Buffer& projection,
                                          const glm::ivec2& size) {
  const gl::DebugScope scope("splat rects");
  const absl::StatusOr<GLuint> program = gpu.programs.Get(RectsProgram(), {});
  if (!program.ok()) return program.status();
  SplatRects rects;
  rects.size = size;
  rects.on_device = gl::MakeBuffer("splat rectangles", particles.count * sizeof(sweep::Rect));
  glUseProgram(*program);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, projection.name());
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kParticlesBinding, particles.uniforms.name());
  gl::BindStorage(shader::kSplatsBinding, splats);
  gl::BindStorage(shader::kSplatRectsBinding, rects.on_device);
  gl::DispatchGroups(gl::DivideUp(particles.count, shader::kListGroupSize));
  if (!device.software) {
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return rects;
  }
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  rects.on_cpu.resize(particles.count);
  glGetNamedBufferSubData(rects.on_device.name(), 0,
                          static_cast<GLsizeiptr>(particles.count * sizeof(sweep::Rect)),
                          rects.on_cpu.data());
  return rects;
}

absl::StatusOr<SplatTiles> ListSplatTiles(Gpu& gpu, const SplatRects& rects,
                                          const sweep::PlaceRun& run, int tile_size) {
  if (!rects.on_cpu.empty()) return ListOnCpu(rects, run, tile_size);
  for (sweep::PlaceRun part = run;; part.end = part.first + (part.end - part.first) / 2) {
    absl::StatusOr<sweep::DeviceTiles> lists =
        ListDeviceTiles(gpu, rects.on_device, part, rects.size, tile_size);
    if (absl::IsResourceExhausted(lists.status()) && part.end - part.first > 1) continue;
    if (!lists.ok()) return lists.status();
    return SplatTiles{*std::move(lists), part};
  }
}

}  // namespace halflight
