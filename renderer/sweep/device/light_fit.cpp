#include "renderer/sweep/device/light_fit.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "renderer/gl/compute.h"
#include "renderer/gl/debug.h"
#include "renderer/passes/project.h"
#include "renderer/sweep/polynomial.h"
#include "shaders/bindings.h"
#include "spirv/fit_light.comp.h"
#include "spirv/sweep_light.comp.h"

namespace halflight::sweep {

namespace {

const gl::ProgramSource& SweepProgram() {
  static const gl::ProgramSource source{"sweep light",
                                        {{GL_COMPUTE_SHADER, spirv_sweep_light_comp}}};
  return source;
}

const gl::ProgramSource& FitProgram() {
  static const gl::ProgramSource source{"fit light", {{GL_COMPUTE_SHADER, spirv_fit_light_comp}}};
  return source;
}

// Terms by terms floats, in vectors of four.
gl::Buffer UploadInverseGram(const DiscFit& disc) {
  shader::InverseGramBlock block = {};
  const std::vector<double>& inverse_gram = disc.inverse_gram();
  for (size_t i = 0; i < inverse_gram.size(); ++i) {
    block.rows[i / 4][static_cast<glm::length_t>(i % 4)] = static_cast<float>(inverse_gram[i]);
  }
  return gl::MakeBlock("inverse gram", block);
}

// What all runs share.
struct LightPasses {
  GLuint sweep;
  GLuint fit;
  const DeviceSprites& sprites;
  const PatchRuns& patch_runs;
  int light_tile;
  gl::Buffer patches;
  gl::Buffer inverse_gram;
};

// Deposits the run into the light buffer and fills its patches.
void SweepRun(const LightPasses& passes, const DeviceTiles& tiles, const DeviceLightFit& fit) {
  const gl::DebugScope scope("sweep light");
  glUseProgram(passes.sweep);
  gl::BindStorage(shader::kLightTileBeginBinding, tiles.begin);
  gl::BindStorage(shader::kLightTileEntriesBinding, tiles.entries);
  gl::BindStorage(shader::kLightDepthBinding, fit.optical_depth);
  glDispatchCompute(static_cast<GLuint>(tiles.tiles.x), static_cast<GLuint>(tiles.tiles.y), 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

// Fits the run's particles to their patches.
void FitRun(const LightPasses& passes, const PlaceRun& run, const DeviceLightFit& fit) {
  const gl::DebugScope scope("fit light");
  glUseProgram(passes.fit);
  glBindBufferBase(GL_UNIFORM_BUFFER, shader::kInverseGramBinding, passes.inverse_gram.name());
  gl::BindStorage(shader::kLightParticlesBinding, passes.sprites.particles);
  gl::BindStorage(shader::kFittedDepthBinding, fit.depth);
  gl::BindStorage(shader::kFittedSpritesBinding, fit.sprites);
  constexpr size_t kTeams = shader::kFitGroupSize / shader::kFitTeamSize;
  gl::DispatchGroups(gl::DivideUp(run.end - run.first, kTeams));
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

absl::Status SweepAndFit(Gpu& gpu, const LightPasses& passes, const TargetProjection& target,
                         const DeviceLightFit& fit, const std::stop_token& stop) {
  for (const PatchRun& run : passes.patch_runs.runs) {
    if (stop.stop_requested()) return absl::CancelledError("frame cancelled");
    absl::StatusOr<DeviceTiles> tiles =
        ListDeviceTiles(gpu, passes.sprites.rects, run.places, target.projection.size,
                        passes.light_tile, run.entries);
    if (!tiles.ok()) return tiles.status();
    const gl::Buffer block = BindRun(run, target.projection.size.x);
    glBindBufferBase(GL_UNIFORM_BUFFER, shader::kProjectionBinding, target.block.name());
    gl::BindStorage(shader::kLightSpritesBinding, passes.sprites.sprites);
    gl::BindStorage(shader::kLightRectsBinding, passes.sprites.rects);
    gl::BindStorage(shader::kPatchOffsetsBinding, passes.patch_runs.offsets);
    gl::BindStorage(shader::kGroupOffsetsBinding, passes.patch_runs.group_offsets);
    gl::BindStorage(shader::kPatchesBinding, passes.patches);
    SweepRun(passes, *tiles, fit);
    FitRun(passes, run.places, fit);
  }
  return absl::OkStatus();
}

absl::Status CheckSizes(size_t particles, size_t texels, int degree) {
  const size_t record = std::max(sizeof(Sprite), Terms(degree) * sizeof(float));
  absl::Status status = gl::CheckStorageBlock("fitted light", particles * record);
  status.Update(gl::CheckStorageBlock("light buffer", texels * sizeof(float)));
  return status;
}

}  // namespace

size_t DeviceLightFit::bytes() const {
  const auto texels = static_cast<size_t>(projection.size.x) * projection.size.y;
  return (count * (Terms(degree) + 4) + texels) * sizeof(float);
}

LightSweepSettings LightSweepSettingsFor(const DeviceInfo& device) {
  LightSweepSettings settings;
  if (!device.software) settings.limits = kLongRuns;
  return settings;
}

absl::StatusOr<DeviceLightFit> FitLightOnDevice(Gpu& gpu, const Light& light,
                                                const ParticleView& particles,
                                                const ParticleBuffers& buffers, Profile profile,
                                                int light_buffer_size, int degree,
                                                const std::stop_token& stop,
                                                const LightSweepSettings& settings) {
  const size_t texels = static_cast<size_t>(light_buffer_size) * light_buffer_size;
  if (absl::Status status = CheckSizes(particles.size(), texels, degree); !status.ok()) {
    return status;
  }

  // See the particles from the light.
  DeviceLightFit fit;
  fit.projection = LightProjection(light, particles, light_buffer_size, 0.0);
  fit.degree = degree;
  fit.count = particles.size();
  const TargetProjection target = UploadProjection(fit.projection, particles);
  absl::StatusOr<DeviceSprites> sprites =
      ListDeviceSprites(gpu, buffers, particles, fit.projection);
  if (!sprites.ok()) return sprites.status();
  absl::StatusOr<PatchRuns> runs =
      CutIntoPatchRuns(gpu, *sprites, settings.light_tile, settings.limits);
  if (!runs.ok()) return runs.status();

  // Make what the passes write.
  fit.depth = gl::MakeBuffer("fitted light", particles.size() * Terms(degree) * sizeof(float));
  fit.sprites = gl::MakeBuffer("light's sprites", particles.size() * sizeof(Sprite));
  fit.optical_depth = gl::MakeBuffer("optical depth", texels * sizeof(float));
  glClearNamedBufferData(fit.optical_depth.name(), GL_R32F, GL_RED, GL_FLOAT, nullptr);
  size_t patch_texels = 0;
  for (const PatchRun& run : runs->runs) patch_texels = std::max(patch_texels, run.texels);

  // Sweep and fit.
  const bool orthographic = fit.projection.orthographic;
  const bool ball = profile == Profile::kBall;
  const absl::StatusOr<GLuint> sweep_program = gpu.programs.Get(
      SweepProgram(),
      {{shader::kOrthographicConstant, orthographic},
       {shader::kBallProfileConstant, ball},
       {shader::kLightTileSizeConstant, static_cast<uint32_t>(settings.light_tile)}});
  if (!sweep_program.ok()) return sweep_program.status();
  const absl::StatusOr<GLuint> fit_program =
      gpu.programs.Get(FitProgram(), {{shader::kOrthographicConstant, orthographic},
                                      {shader::kBallProfileConstant, ball},
                                      {shader::kFitDegreeConstant, static_cast<uint32_t>(degree)}});
  if (!fit_program.ok()) return fit_program.status();
  const LightPasses passes{*sweep_program,
                           *fit_program,
                           *sprites,
                           *runs,
                           settings.light_tile,
                           gl::MakeBuffer("patches", patch_texels * sizeof(float)),
                           UploadInverseGram(DiscFit(profile, degree))};
  absl::Status status = SweepAndFit(gpu, passes, target, fit, stop);
  status.Update(gl::CheckErrors("light sweep"));
  if (!status.ok()) return status;
  return fit;
}

void ReadOpticalDepth(const DeviceLightFit& fit, Readback& readback, Image& image) {
  image = {fit.projection.size.x, fit.projection.size.y, 1, {"Y"}, {}};
  readback.Copy(fit.optical_depth, image);
}

}  // namespace halflight::sweep
