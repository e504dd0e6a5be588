// A frame pipeline over the fake engine, for its tests.
// Encodes and measures as the options say.
#pragma once

#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>

#include <gtest/gtest.h>

#include "server/frame_pipeline.h"
#include "tests/server/fake_engine.h"

namespace halflight::testing {

using Result = absl::StatusOr<std::shared_ptr<const EncodedFrame>>;

class PipelineTest : public ::testing::Test {
 protected:
  void Start(PipelineOptions options) { pipeline_.emplace(engine_, std::move(options)); }

  std::future<Result> Submit(FrameJob job, std::stop_token stop = {}) {
    auto promise = std::make_shared<std::promise<Result>>();
    const absl::Status status =
        pipeline_->Submit(std::move(job), std::move(stop),
                          [promise](Result result) { promise->set_value(std::move(result)); });
    if (!status.ok()) {
      promise->set_value(status);
    }
    return promise->get_future();
  }

  FakeEngine engine_;
  std::optional<FramePipeline> pipeline_;
};

}  // namespace halflight::testing
