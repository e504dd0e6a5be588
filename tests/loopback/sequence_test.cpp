// RenderSequence through the client library: order, what changes from frame to frame, how it ends.

#include <cmath>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/loopback/test_server.h"
#include "tests/loopback/wire_scene.h"
#include "tests/process/wait_for.h"
#include "tests/renderer/test_scene.h"

namespace halflight::loopback {
namespace {

using ::testing::StartsWith;
using testing::WaitFor;

// The camera goes round the cloud, which changes every other frame.
Scene SceneOf(uint64_t index) {
  Scene scene = test::BallScene(150, 32);
  scene.particles = test::Ball(150, 1 + index / 2);
  const double angle = static_cast<double>(index) * 50.0 * test::kDegree;
  scene.camera =
      test::LookAt({4.0 * std::sin(angle), 0.5, 4.0 * std::cos(angle)}, {0, 0, 0}, 32, 32);
  return scene;
}

client::SequenceFrame FrameOf(uint64_t index) {
  client::SequenceFrame frame{RequestWithoutParticles(SceneOf(index)),
                              Encoded(*SceneOf(index).particles)};
  *frame.request.add_outputs() = OutputOf(v1::OUTPUT_KIND_BEAUTY);
  *frame.request.add_outputs() = OutputOf(v1::OUTPUT_KIND_LIGHT_BUFFER, v1::IMAGE_FORMAT_EXR_HALF);
  frame.request.set_request_id("turn." + std::to_string(index));
  return frame;
}

TEST(Sequence, FramesComeInOrderAndAreThoseOfRenderFrame) {
  const TestServer server;
  client::Client client = server.Connect();
  std::vector<client::RenderedFrame> frames;
  const absl::Status status = client.RenderSequence(
      6, [](uint64_t index) -> absl::StatusOr<client::SequenceFrame> { return FrameOf(index); },
      [&](uint64_t index, client::RenderedFrame frame) {
        EXPECT_EQ(index, frames.size());
        frames.push_back(std::move(frame));
        return absl::OkStatus();
      });
  ASSERT_TRUE(status.ok()) << status;
  ASSERT_EQ(frames.size(), 6U);
  for (uint64_t index = 0; index < frames.size(); ++index) {
    const client::SequenceFrame alone = FrameOf(index);
    EXPECT_EQ(frames[index].header.metadata().request_id(), alone.request.request_id());
    EXPECT_EQ(frames[index].outputs, MustRender(client, alone.request, &*alone.particles).outputs)
        << "frame " << index;
    EXPECT_NE(frames[index].outputs[0], frames[(index + 1) % 6].outputs[0]);
  }
}

TEST(Sequence, WhatARequestLeavesOutStaysAsItWas) {
  const TestServer server;
  client::Client client = server.Connect();
  std::vector<std::string> frames;
  const absl::Status status = client.RenderSequence(
      4,
      [](uint64_t index) -> absl::StatusOr<client::SequenceFrame> {
        client::SequenceFrame frame;
        if (index == 0) {
          frame.request = RequestOf(SceneOf(0));
        } else if (index == 1) {
          *frame.request.mutable_scene()->mutable_camera() =
              RequestWithoutParticles(SceneOf(1)).scene().camera();
        } else if (index == 2) {
          *frame.request.mutable_scene()->mutable_inline_particles() =
              Inline(*SceneOf(2).particles);
        }
        return frame;
      },
      [&](uint64_t, const client::RenderedFrame& frame) {
        frames.push_back(frame.outputs[0]);
        return absl::OkStatus();
      });
  ASSERT_TRUE(status.ok()) << status;
  ASSERT_EQ(frames.size(), 4U);
  Scene last = SceneOf(1);
  last.particles = SceneOf(2).particles;
  EXPECT_EQ(frames[0], MustRender(client, RequestOf(SceneOf(0))).outputs[0]);
  EXPECT_EQ(frames[1], MustRender(client, RequestOf(SceneOf(1))).outputs[0]);
  EXPECT_EQ(frames[2], MustRender(client, RequestOf(last)).outputs[0]);
  EXPECT_EQ(frames[3], frames[2]) << "a request that says nothing repeats the frame";
}

TEST(Sequence, InvalidRequestInTheMiddleEndsItAfterTheFramesBefore) {
  const TestServer server;
  client::Client client = server.Connect();
  std::vector<std::string> frames;
  const absl::Status status = client.RenderSequence(
      6,
      [](uint64_t index) -> absl::StatusOr<client::SequenceFrame> {
        client::SequenceFrame frame = FrameOf(index);
        if (index == 3) {
          frame.request.mutable_scene()->mutable_shadow()->set_slices(1U << 30U);
        }
        return frame;
      },
      [&](uint64_t, const client::RenderedFrame& frame) {
        frames.push_back(frame.outputs[0]);
        return absl::OkStatus();
      });
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              StartsWith("frame 3: scene.shadow.slices: 1073741824"));
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[2], MustRender(client, RequestOf(SceneOf(2))).outputs[0]);
}

TEST(Sequence, TheNextSetsArriveWhileAFrameIsRenderedAndNoMoreThanAllowed) {
  constexpr uint64_t kFrames = 12;
  constexpr uint32_t kAhead = 3;
  const TestServer server;
  const auto set_of = [](uint64_t index) { return Encoded(*test::Ball(50, 100 + index)); };
  std::vector<std::string> names;
  for (uint64_t index = 0; index < kFrames; ++index) names.push_back(set_of(index).sha256);

  uint64_t taken = 0;
  absl::Status status;
  std::jthread caller;
  {
    const RendererHeld held;
    caller = std::jthread([&] {
      client::Client client = server.Connect();
      status = client.RenderSequence(
          kFrames,
          [&](uint64_t index) -> absl::StatusOr<client::SequenceFrame> {
            client::SequenceFrame frame = FrameOf(index);
            frame.particles = set_of(index);
            return frame;
          },
          [&](uint64_t, const client::RenderedFrame&) {
            ++taken;
            return absl::OkStatus();
          },
          kAhead);
    });
    // Nothing is rendered yet, and the sets of the frames ahead are there; those behind are not.
    client::Client other = server.Connect();
    const auto missing = [&] { return *other.FindMissing(names); };
    EXPECT_TRUE(WaitFor([&] { return missing().size() <= kFrames - 1 - kAhead; }));
    EXPECT_EQ(missing(), std::vector<std::string>(names.begin() + 1 + kAhead, names.end()));
    EXPECT_EQ(taken, 0U);
  }
  caller.join();
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(taken, kFrames);
}

TEST(Sequence, CancelledMidwayLeavesTheServerAsItWas) {
  const TestServer server;
  std::stop_source stop;
  {
    client::ClientOptions options;
    options.stop = stop.get_token();
    client::Client client = server.Connect(options);
    uint64_t taken = 0;
    const absl::Status status = client.RenderSequence(
        1000,
        [](uint64_t index) -> absl::StatusOr<client::SequenceFrame> { return FrameOf(index); },
        [&](uint64_t index, const client::RenderedFrame&) {
          taken = index + 1;
          if (index == 2) {
            stop.request_stop();
          }
          return absl::OkStatus();
        });
    EXPECT_EQ(status.code(), absl::StatusCode::kCancelled) << status;
    EXPECT_GE(taken, 3U);
    EXPECT_LT(taken, 1000U);
  }
  EXPECT_TRUE(WaitFor([&] { return server.idle(); }));
  client::Client client = server.Connect();
  const Scene scene = SceneOf(1);
  const auto pixels = MustRender(client, RequestOf(scene)).outputs;
  const TestServer fresh;
  client::Client other = fresh.Connect();
  EXPECT_EQ(pixels, MustRender(other, RequestOf(scene)).outputs);
}

TEST(Sequence, ErrorOfTheSinkEndsItAtOnce) {
  const TestServer server;
  client::Client client = server.Connect();
  const absl::Status status = client.RenderSequence(
      6, [](uint64_t index) -> absl::StatusOr<client::SequenceFrame> { return FrameOf(index); },
      [&](uint64_t index, const client::RenderedFrame&) {
        return index == 1 ? absl::DataLossError("disk full") : absl::OkStatus();
      });
  EXPECT_EQ(status, absl::DataLossError("disk full"));
  EXPECT_TRUE(WaitFor([&] { return server.idle(); }));
}

}  // namespace
}  // namespace halflight::loopback
