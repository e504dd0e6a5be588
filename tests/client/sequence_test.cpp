// Sequences against a service in this process: order, read-ahead, streams that break off.
#include <gmock/gmock.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <utility>

#include "client/client.h"
#include "tests/client/fake_service.h"
#include "tests/client/test_bytes.h"

namespace halflight::client {
namespace {

using absl::StatusCode;
using testing::Each;
using testing::ElementsAre;

const grpc::Status kUnavailable(grpc::StatusCode::UNAVAILABLE, "draining");

class SequenceTest : public testing::Test {
 protected:
  absl::Status Render(uint64_t count, uint32_t read_ahead = 4) {
    options_.first_backoff = std::chrono::milliseconds(2);
    Client client = *Client::Connect(service_.address(), options_);
    auto sink = [this](uint64_t index, const RenderedFrame& frame) {
      taken_.push_back(index);
      EXPECT_EQ(frame.header.metadata().request_id(), "f" + std::to_string(index));
      return sink_ ? sink_(index) : absl::OkStatus();
    };
    return client.RenderSequence(
        count, [this](uint64_t index) { return Source(index); }, sink, read_ahead);
  }

  absl::StatusOr<SequenceFrame> Source(uint64_t index) {
    sourced_ = index + 1;
    if (index == fail_source_at_) {
      return absl::DataLossError("f.ply: line 3");
    }
    if (index == throw_at_) {
      throw std::out_of_range("out of reach");
    }
    SequenceFrame frame;
    frame.request.set_request_id("f" + std::to_string(index));
    if (inherits_ && index > 0) {
      if (index == 1) {
        frame.request.mutable_scene()->mutable_camera()->set_width(11);
        frame.request.mutable_target()->set_max_error(0.5);
      }
      return frame;
    }
    frame.request.add_outputs()->set_kind(v1::OUTPUT_KIND_BEAUTY);
    frame.request.mutable_scene()->mutable_shadow()->set_slices(3);
    Particles particles;
    particles.positions.assign(30, static_cast<float>(index));
    frame.particles = EncodeParticles(particles);
    return frame;
  }

  FakeService service_;
  ClientOptions options_;
  std::vector<uint64_t> taken_;
  std::atomic<uint64_t> sourced_ = 0;
  uint64_t fail_source_at_ = 1000;
  uint64_t throw_at_ = 1000;
  bool inherits_ = false;  // requests after the first leave out what they can
  std::function<absl::Status(uint64_t)> sink_;
};

TEST_F(SequenceTest, BringsFramesInOrderOverOneStream) {
  ASSERT_TRUE(Render(6).ok());
  EXPECT_THAT(taken_, ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(service_.Calls("RenderSequence"), 1);
  EXPECT_EQ(service_.Calls("UploadParticles"), 6);
}

TEST_F(SequenceTest, RendersNothingForNoFrames) {
  EXPECT_TRUE(Render(0).ok());
  EXPECT_EQ(service_.Calls("RenderSequence"), 0);
}

TEST_F(SequenceTest, ReadsAheadNoFurtherThanAllowed) {
  for (const uint32_t read_ahead : {0U, 3U}) {
    taken_.clear();
    uint64_t furthest = 0;
    sink_ = [&](uint64_t index) {
      // Time for a sender that would run away to do so.
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      furthest = std::max(furthest, sourced_ - 1 - index);
      return absl::OkStatus();
    };
    ASSERT_TRUE(Render(10, read_ahead).ok());
    EXPECT_EQ(furthest, read_ahead);
  }
}

TEST_F(SequenceTest, GoesOnWhereTheStreamBrokeOff) {
  int failures = 2;
  service_.before_frame = [&](uint64_t index) {
    return index == 3 && failures-- > 0 ? kUnavailable : grpc::Status::OK;
  };
  ASSERT_TRUE(Render(9).ok());
  EXPECT_THAT(taken_, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_EQ(service_.Calls("RenderSequence"), 3);
  // Every stream goes where the particles of the first went.
  EXPECT_THAT(service_.routes, Each(service_.routes[0]));
  EXPECT_FALSE(service_.routes[0].empty());
}

TEST_F(SequenceTest, GivesUpWhereNoFrameComes) {
  options_.max_attempts = 3;
  service_.before_frame = [](uint64_t index) {
    return index == 1 ? kUnavailable : grpc::Status::OK;
  };
  // The frame that each new stream brings counts as progress, so a lasting failure is needed.
  service_.FailNext("RenderSequence", {grpc::Status::OK, kUnavailable, kUnavailable, kUnavailable});
  ExpectError(Render(5), StatusCode::kUnavailable, {"after 3 tries", "draining"});
  EXPECT_THAT(taken_, ElementsAre(0));
}

TEST_F(SequenceTest, SendsParticlesAgainThatWereDropped) {
  service_.evict_after_upload = 1;
  ASSERT_TRUE(Render(4).ok());
  EXPECT_THAT(taken_, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(service_.Calls("RenderSequence"), 2);
}

TEST_F(SequenceTest, ReturnsARefusalWithTheFramesNumber) {
  int streams = 0;
  service_.before_frame = [&](uint64_t index) {
    if (streams == 0 && index == 2) {
      ++streams;
      return kUnavailable;
    }
    // Frame 1 of the second stream is frame 3 of the sequence.
    return streams == 1 && index == 1
               ? grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "scene.camera.width is 0")
               : grpc::Status::OK;
  };
  ExpectError(Render(9), StatusCode::kInvalidArgument, {"frame 3: scene.camera.width is 0"});
  EXPECT_THAT(taken_, ElementsAre(0, 1, 2));
}

TEST_F(SequenceTest, BringsTheFramesBeforeASourceThatFails) {
  fail_source_at_ = 3;
  ExpectError(Render(9), StatusCode::kDataLoss, {"f.ply: line 3"});
  EXPECT_THAT(taken_, ElementsAre(0, 1, 2));
}

TEST_F(SequenceTest, EndsWithTheErrorOfTheSink) {
  sink_ = [](uint64_t index) {
    return index == 1 ? absl::UnknownError("disk full") : absl::OkStatus();
  };
  ExpectError(Render(9), StatusCode::kUnknown, {"disk full"});
  EXPECT_THAT(taken_, ElementsAre(0, 1));
}

TEST_F(SequenceTest, DetectsFramesOutOfOrder) {
  service_.tamper = [](v1::RenderSequenceResponse& message) {
    if (message.frame_index() == 1) {
      message.set_frame_index(2);
    }
  };
  ExpectError(Render(4), StatusCode::kDataLoss, {"frame 2 came where frame 1"});
}

TEST_F(SequenceTest, TakesNoFrameBeyondTheLast) {
  service_.unasked_frame = 3;
  EXPECT_TRUE(Render(3).ok());
  EXPECT_THAT(taken_, ElementsAre(0, 1, 2));
}

TEST_F(SequenceTest, RefusesAFrameThatItHasNotAskedFor) {
  service_.unasked_frame = 1;
  ExpectError(Render(3, 0), StatusCode::kDataLoss, {});
  EXPECT_THAT(taken_, ElementsAre(0));
}

TEST_F(SequenceTest, IsDoneWithTheLastFrameHoweverTheStreamEnds) {
  service_.end_of_sequence = {grpc::StatusCode::INTERNAL, "late fault"};
  EXPECT_TRUE(Render(3).ok());
  EXPECT_EQ(service_.Calls("RenderSequence"), 1);
}

TEST_F(SequenceTest, EndsWithTheExceptionOfTheSource) {
  throw_at_ = 2;
  ExpectError(Render(4), StatusCode::kInternal, {"frame 2: out of reach"});
  EXPECT_THAT(taken_, ElementsAre(0, 1));
}

TEST_F(SequenceTest, DoesNotTakeItsOwnTimeForSilence) {
  options_.timeout = std::chrono::milliseconds(500);
  sink_ = [](uint64_t index) {
    if (index == 1) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1200));
    }
    return absl::OkStatus();
  };
  const absl::Status status = Render(4);
  EXPECT_TRUE(status.ok()) << status;
}

TEST_F(SequenceTest, WhatRequestsLeaveOutSurvivesABrokenStream) {
  inherits_ = true;
  std::vector<v1::RenderFrameRequest> seen;
  service_.on_request = [&](const v1::RenderFrameRequest& request) { seen.push_back(request); };
  bool broken = false;
  service_.before_frame = [&](uint64_t index) {
    return index == 2 && !std::exchange(broken, true) ? kUnavailable : grpc::Status::OK;
  };
  ASSERT_TRUE(Render(4, 0).ok());
  ASSERT_EQ(seen.size(), 5U);
  EXPECT_FALSE(seen[2].scene().has_camera());
  const v1::RenderFrameRequest& first_of_second = seen[3];
  EXPECT_EQ(first_of_second.request_id(), "f2");
  EXPECT_EQ(first_of_second.outputs_size(), 1);
  EXPECT_EQ(first_of_second.scene().camera().width(), 11U) << "of frame 1";
  EXPECT_EQ(first_of_second.target().max_error(), 0.5) << "of frame 1, which ended the shadow";
  EXPECT_FALSE(first_of_second.scene().has_shadow());
  EXPECT_FALSE(first_of_second.scene().particle_sha256().empty());
  EXPECT_FALSE(seen[4].scene().has_camera());
}

TEST_F(SequenceTest, DetectsDamagedOutputs) {
  service_.tamper = [](v1::RenderSequenceResponse& message) {
    if (message.frame_index() == 2 && message.has_chunk()) {
      (*message.mutable_chunk()->mutable_data())[7] ^= 1;
    }
  };
  ExpectError(Render(4), StatusCode::kDataLoss, {"CRC-32C"});
  EXPECT_THAT(taken_, ElementsAre(0, 1));
}

TEST_F(SequenceTest, EndsWhenTheServerFallsSilent) {
  options_.timeout = std::chrono::milliseconds(200);
  service_.before_frame = [](uint64_t index) {
    if (index == 1) {
      std::this_thread::sleep_for(std::chrono::seconds(1));
    }
    return grpc::Status::OK;
  };
  ExpectError(Render(4), StatusCode::kDeadlineExceeded, {"0.2 s", "frame 1 "});
}

TEST_F(SequenceTest, EndsWhenStopped) {
  std::stop_source stop;
  options_.stop = stop.get_token();
  sink_ = [&stop](uint64_t index) {
    if (index == 1) {
      stop.request_stop();
    }
    return absl::OkStatus();
  };
  EXPECT_EQ(Render(1000).code(), StatusCode::kCancelled);
  EXPECT_LT(taken_.size(), 1000U);
}

}  // namespace
}  // namespace halflight::client
