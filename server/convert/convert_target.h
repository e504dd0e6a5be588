// What a frame has to reach in place of settings, from the request's target, with every check of
// it. Chooses no settings.
#pragma once

#include <memory>
#include <optional>

#include "halflight/v1/service.pb.h"
#include "renderer/target/search.h"
#include "server/convert/convert_outputs.h"
#include "server/convert/field_checks.h"
#include "server/limits.h"

namespace halflight {

struct TargetJob {
  TargetGoal goal;
  TargetLimits limits;  // in which all outputs keep to theirs
  // Pixels at which an error may be measured, at most.
  int max_samples = 0;
  // Of this frame alone, or of the frames that it is one of a sequence with.
  std::shared_ptr<TargetKnowledge> knowledge;
};

// Rejects settings beside a target. Field paths start with "target" or "scene.shadow".
void CheckTarget(const v1::RenderFrameRequest& request, FieldChecks& checks);

// Of a request that has a target; everything else of it has passed its checks. `samples`: to
// measure errors with at first. Changes `plan.pixel_bytes` to what outputs come to at most,
// whatever is chosen.
TargetJob ConvertTarget(const v1::RenderFrameRequest& request, const Scene& scene, int samples,
                        const ServerLimits& limits, OutputPlan& plan);

// The other way.
v1::Target DescribeTarget(const TargetGoal& goal);

}  // namespace halflight
