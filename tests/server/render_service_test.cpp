// The service behind a real gRPC server in this process, with a fake engine.

#include "server/render_service.h"

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "halflight/crc32c.h"
#include "halflight/v1/service.grpc.pb.h"
#include "server/grpc_server.h"
#include "tests/process/wait_for.h"
#include "tests/server/fake_engine.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

using testing::Chunk;
using testing::Describe;
using ::testing::ElementsAre;
using testing::EncodePlain;
using testing::FakeEngine;
using testing::Finish;
using ::testing::HasSubstr;
using testing::Header;
using testing::MakeParticles;
using testing::MakeRequest;
using testing::WaitFor;

class Service : public ::testing::Test {
 protected:
  explicit Service(const ServerLimits& limits = {}) : limits_(limits) {
    auto server = GrpcServer::Start({"127.0.0.1:0"}, backend_);
    EXPECT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->addresses()[0], grpc::InsecureChannelCredentials());
    stub_ = v1::RenderService::NewStub(channel_);
  }

  // A frame of several MiB, so that it cannot fit into the buffers on its way.
  static v1::RenderFrameRequest LargeRequest() {
    v1::RenderFrameRequest request = MakeRequest();
    request.mutable_scene()->mutable_camera()->set_width(1024);
    request.mutable_scene()->mutable_camera()->set_height(1024);
    return request;
  }

  static constexpr const char* kMalformed = "\x0a\xff not a message";

  // Sends messages as they are, and returns how the call ends.
  grpc::Status Send(const std::string& rpc, const std::vector<std::string>& messages) {
    grpc::GenericStub generic(channel_);
    grpc::CompletionQueue queue;
    grpc::ClientContext context;
    auto call = generic.PrepareCall(&context, "/halflight.v1.RenderService/" + rpc, &queue);
    const auto wait = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      queue.Next(&tag, &ok);
    };
    call->StartCall(nullptr);
    wait();
    for (const std::string& bytes : messages) {
      const grpc::Slice slice(bytes);
      call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
      wait();
    }
    if (rpc != "RenderSequence") {
      call->WritesDone(nullptr);
      wait();
    }
    grpc::Status status;
    call->Finish(&status, nullptr);
    wait();
    return status;
  }

  grpc::Status RenderAll(const v1::RenderFrameRequest& request) {
    grpc::ClientContext context;
    auto reader = stub_->RenderFrame(&context, request);
    v1::RenderFrameResponse response;
    while (reader->Read(&response)) {
    }
    return reader->Finish();
  }

  // Two clients' frames, which are drawn once the engine's gate is opened.
  void HoldTwoFrames() {
    engine_.SetGate(false);
    for (int i = 0; i < 2; ++i) {
      held_.emplace_back([this] { EXPECT_TRUE(RenderAll(MakeRequest()).ok()); });
    }
    ASSERT_TRUE(WaitFor([this] { return pipeline_.queued() == 2; }));
  }

  FakeEngine engine_;
  ServerLimits limits_;
  std::string version_ = "1.2.3";
  ParticleStore store_{8 << 20};
  ByteBudget upload_memory_{8 << 20};
  PartialUploads partial_uploads_{upload_memory_, {}};
  FramePipeline pipeline_{
      engine_, {.admission = {.max_queued_frames = 2}, .encode_threads = 2, .encode = EncodePlain}};
  Backend backend_{engine_.device(), limits_, version_, store_, partial_uploads_, pipeline_};
  std::unique_ptr<GrpcServer> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::RenderService::Stub> stub_;
  std::vector<std::jthread> held_;  // last: they use all of the above
};

TEST_F(Service, FrameBytesMatchTheTrailer) {
  grpc::ClientContext context;
  auto reader = stub_->RenderFrame(&context, LargeRequest());
  v1::RenderFrameResponse response;
  v1::FrameHeader header;
  v1::FrameTrailer trailer;
  std::string bytes;
  while (reader->Read(&response)) {
    if (response.has_header()) {
      header = response.header();
    } else if (response.has_chunk()) {
      bytes += response.chunk().data();
    } else {
      trailer = response.trailer();
    }
  }
  const grpc::Status status = reader->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(bytes.size(), 1024U * 1024U * 16U);
  EXPECT_EQ(header.outputs(0).byte_size(), bytes.size());
  ASSERT_EQ(trailer.output_crc32c_size(), 1);
  EXPECT_EQ(trailer.output_crc32c(0), ExtendCrc32c(0, bytes));
}

TEST_F(Service, CancelledInMidStreamTheServerLetsGoAndLivesOn) {
  for (int round = 0; round < 20; ++round) {
    grpc::ClientContext context;
    auto reader = stub_->RenderFrame(&context, LargeRequest());
    v1::RenderFrameResponse response;
    for (int i = 0; i < round % 5; ++i) {
      ASSERT_TRUE(reader->Read(&response));
    }
    context.TryCancel();
    EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_TRUE(WaitFor([this] { return server_->idle(); }));
  EXPECT_TRUE(RenderAll(MakeRequest()).ok());
}

TEST_F(Service, DeadlineStopsAFrameThatWaits) {
  engine_.SetGate(false);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(100));
  auto reader = stub_->RenderFrame(&context, MakeRequest());
  v1::RenderFrameResponse response;
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_TRUE(WaitFor([this] { return engine_.waiting() == 0; })) << "the work was not stopped";
  EXPECT_EQ(engine_.rendered(), 0);
}

TEST_F(Service, FullQueueSaysWhenToRetry) {
  ASSERT_NO_FATAL_FAILURE(HoldTwoFrames());
  grpc::ClientContext context;
  auto reader = stub_->RenderFrame(&context, MakeRequest());
  v1::RenderFrameResponse response;
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(context.GetServerTrailingMetadata().count("grpc-retry-pushback-ms"), 1U);
  engine_.SetGate(true);
}

class ImpatientService : public Service {
 protected:
  ImpatientService() : Service({.max_stall_seconds = 1, .max_calls = 2}) {}
};

TEST_F(ImpatientService, ReaderThatStopsReadingLosesItsCallAndHoldsNothing) {
  grpc::ClientContext context;
  auto reader = stub_->RenderFrame(&context, LargeRequest());
  v1::RenderFrameResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_FALSE(server_->idle());
  EXPECT_TRUE(WaitFor([this] { return server_->idle(); })) << "the call waits for its reader";
  while (reader->Read(&response)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

class StrictService : public Service {
 protected:
  StrictService() : Service({.max_stall_seconds = 1, .min_bytes_per_second = kGiB}) {}
};

TEST_F(StrictService, ReaderThatTakesTooLittleLosesItsCallHoweverSteady) {
  grpc::ClientContext context;
  auto reader = stub_->RenderFrame(&context, LargeRequest());
  v1::RenderFrameResponse response;
  while (reader->Read(&response)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(StrictService, UploadThatSendsTooLittleLosesItsCallHoweverSteady) {
  grpc::ClientContext context;
  v1::UploadParticlesResponse response;
  const auto writer = stub_->UploadParticles(&context, &response);
  const auto header =
      testing::Header(testing::Describe(MakeParticles(1000, {v1::PARTICLE_ATTRIBUTE_POSITION})));
  bool goes_on = writer->Write(header);
  for (int i = 0; i < 100 && goes_on; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    goes_on = writer->Write(testing::Chunk("x"));
  }
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(ImpatientService, UploadThatStopsSendingLosesItsCall) {
  grpc::ClientContext context;
  v1::UploadParticlesResponse response;
  const auto writer = stub_->UploadParticles(&context, &response);
  ASSERT_TRUE(WaitFor([this] { return !server_->idle(); }));
  EXPECT_TRUE(WaitFor([this] { return server_->idle(); })) << "the call waits for its writer";
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(ImpatientService, SequenceMayWaitForItsNextRequestAsLongAsItLikes) {
  grpc::ClientContext context;
  auto stream = stub_->RenderSequence(&context);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  v1::RenderSequenceRequest request;
  *request.mutable_frame() = MakeRequest();
  stream->Write(request);
  stream->WritesDone();
  v1::RenderSequenceResponse response;
  while (stream->Read(&response)) {
  }
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(ImpatientService, CallsBeyondTheLimitAreToldToComeBack) {
  ASSERT_NO_FATAL_FAILURE(HoldTwoFrames());
  grpc::ClientContext context;
  v1::GetServerInfoResponse info;
  const grpc::Status status = stub_->GetServerInfo(&context, {}, &info);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_details(), HasSubstr("TOO_MANY_CALLS"));
  EXPECT_EQ(context.GetServerTrailingMetadata().count("grpc-retry-pushback-ms"), 1U);
  engine_.SetGate(true);
}

class NarrowService : public Service {
 protected:
  NarrowService() : Service({.max_connection_streams = 2}) {}
};

TEST_F(NarrowService, CallsOfOneConnectionBeyondTheLimitWaitForOthersToEnd) {
  ASSERT_NO_FATAL_FAILURE(HoldTwoFrames());
  const auto ask = [this](std::chrono::milliseconds time) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + time);
    v1::GetServerInfoResponse info;
    return stub_->GetServerInfo(&context, {}, &info).error_code();
  };
  EXPECT_EQ(ask(std::chrono::milliseconds(200)), grpc::StatusCode::DEADLINE_EXCEEDED);
  engine_.SetGate(true);
  EXPECT_EQ(ask(std::chrono::seconds(30)), grpc::StatusCode::OK);
}

TEST_F(Service, ErrorCarriesItsFieldForPrograms) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->mutable_shadow()->set_slices(4000000000U);
  const grpc::Status status = RenderAll(request);
  EXPECT_THAT(status.error_details(), HasSubstr("type.googleapis.com/google.rpc.BadRequest"));
  EXPECT_THAT(status.error_details(), HasSubstr("LIMIT_EXCEEDED"));
  EXPECT_THAT(status.error_details(), HasSubstr("scene.shadow.slices"));
}

TEST_F(Service, SequenceComesInOrderWhileRequestsGoOn) {
  grpc::ClientContext context;
  auto stream = stub_->RenderSequence(&context);
  std::jthread writer([&] {
    for (int i = 0; i < 30; ++i) {
      v1::RenderSequenceRequest request;
      if (i == 0) {
        *request.mutable_frame() = MakeRequest();
      }
      request.mutable_frame()->set_request_id(std::to_string(i));
      if (!stream->Write(request)) {
        break;
      }
    }
    stream->WritesDone();
  });
  v1::RenderSequenceResponse response;
  int frames = 0;
  while (stream->Read(&response)) {
    EXPECT_EQ(response.frame_index(), static_cast<uint64_t>(frames));
    if (response.has_header()) {
      EXPECT_EQ(response.header().metadata().request_id(), std::to_string(frames));
    }
    frames += response.has_trailer() ? 1 : 0;
  }
  writer.join();
  const grpc::Status status = stream->Finish();
  // Though the queue of two is shorter than what the stream may have under way.
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(frames, 30);
}

TEST_F(Service, SequenceCancelledInMidStreamEnds) {
  for (int round = 0; round < 20; ++round) {
    grpc::ClientContext context;
    auto stream = stub_->RenderSequence(&context);
    v1::RenderSequenceRequest request;
    *request.mutable_frame() = LargeRequest();
    ASSERT_TRUE(stream->Write(request));
    v1::RenderSequenceResponse response;
    if (round % 2 == 0) {
      ASSERT_TRUE(stream->Read(&response));
    }
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_TRUE(WaitFor([this] { return server_->idle(); }));
}

TEST_F(Service, UploadedSetIsFoundAndRendered) {
  const v1::InlineParticles particles =
      MakeParticles(1000, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS});
  const v1::ParticleSetDescription header = Describe(particles);
  v1::FindMissingParticlesRequest question;
  question.add_sha256(header.sha256());
  {
    grpc::ClientContext context;
    v1::FindMissingParticlesResponse missing;
    ASSERT_TRUE(stub_->FindMissingParticles(&context, question, &missing).ok());
    EXPECT_EQ(missing.missing_sha256_size(), 1);
  }
  for (const bool again : {false, true}) {
    grpc::ClientContext context;
    v1::UploadParticlesResponse response;
    auto writer = stub_->UploadParticles(&context, &response);
    writer->Write(Header(header));
    writer->Write(Chunk(particles.payload()));
    writer->Write(Finish(header));
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.already_present(), again);
  }
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->set_particle_sha256(header.sha256());
  EXPECT_TRUE(RenderAll(request).ok());
  EXPECT_EQ(engine_.last_request().scene.particles->size(), 1000U);
}

TEST_F(Service, OneSetFromTwoClientsAtOnceIsCommittedOnceAndBothAreTold) {
  const v1::InlineParticles particles = MakeParticles(1000, {v1::PARTICLE_ATTRIBUTE_POSITION});
  const v1::ParticleSetDescription header = Describe(particles);
  struct Upload {
    grpc::ClientContext context;
    v1::UploadParticlesResponse response;
    std::unique_ptr<grpc::ClientWriter<v1::UploadParticlesRequest>> writer;
  };
  Upload uploads[2];
  for (Upload& upload : uploads) {
    upload.writer = stub_->UploadParticles(&upload.context, &upload.response);
    ASSERT_TRUE(upload.writer->Write(Header(header)));
    ASSERT_TRUE(upload.writer->Write(Chunk(particles.payload().substr(0, 5000))));
  }
  ASSERT_TRUE(WaitFor([this] { return upload_memory_.used() == 10000; }));
  for (Upload& upload : uploads) {
    // What the server has no more need of it does not read to its end.
    upload.writer->Write(Chunk(particles.payload().substr(5000)));
    upload.writer->Write(Finish(header));
    upload.writer->WritesDone();
    const grpc::Status status = upload.writer->Finish();
    ASSERT_TRUE(status.ok()) << status.error_message();
  }
  EXPECT_FALSE(uploads[0].response.already_present());
  EXPECT_TRUE(uploads[1].response.already_present());
  EXPECT_TRUE(store_.Touch(header.sha256()));
  EXPECT_TRUE(WaitFor([this] { return upload_memory_.used() == 0; }));
}

TEST_F(Service, UploadWithAMessageThatCannotBeReadIsNeverWellAndCommitsNothing) {
  const v1::InlineParticles particles =
      MakeParticles(100000, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS});
  const v1::ParticleSetDescription description = testing::Describe(particles);
  const std::string header = testing::Header(description).SerializeAsString();
  const std::string chunk = testing::Chunk(particles.payload()).SerializeAsString();
  const std::string finish = testing::Finish(description).SerializeAsString();
  for (const std::vector<std::string>& stream : std::vector<std::vector<std::string>>{
           {header, chunk, kMalformed},
           {header, chunk, kMalformed, finish},
           {kMalformed, header, chunk, finish},
           {header, chunk.substr(0, chunk.size() - 1), finish},
           {header, chunk, finish.substr(0, finish.size() - 1)},
           {header, testing::Chunk(std::string(3 * kMiB, '\0')).SerializeAsString(), finish},
           {header, finish, chunk},
           {chunk, header, finish},
           {finish},
           {header, chunk},
           {""}}) {
    EXPECT_FALSE(Send("UploadParticles", stream).ok());
    EXPECT_FALSE(store_.Touch(description.sha256()));
  }
}

// Inflated it could be anything, and before anybody is asked who they are.
TEST_F(Service, CompressedMessagesAreRefused) {
  grpc::ClientContext context;
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  v1::FindMissingParticlesRequest request;
  for (int i = 0; i < 1000; ++i) {
    request.add_sha256(std::string(32, 'a'));
  }
  v1::FindMissingParticlesResponse response;
  EXPECT_EQ(stub_->FindMissingParticles(&context, request, &response).error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(Service, MalformedRequestsAreRefused) {
  for (const std::string rpc : {"GetServerInfo", "UploadParticles"}) {
    const grpc::Status status = Send(rpc, {kMalformed});
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << rpc;
    EXPECT_THAT(status.error_message(), HasSubstr("message: bytes that are none, allowed: a "));
  }
  const grpc::Status of_frame = Send("RenderFrame", {kMalformed});
  EXPECT_EQ(of_frame.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(of_frame.error_message(),
            "message: bytes that are none, allowed: a RenderFrameRequest");
  const grpc::Status of_sequence = Send("RenderSequence", {kMalformed});
  EXPECT_EQ(of_sequence.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(of_sequence.error_message(),
            "frame 0: message: bytes that are none, allowed: a RenderSequenceRequest");
}

TEST_F(Service, MessageThatWouldTakeManyTimesItsBytesIsRefused) {
  v1::RenderFrameRequest request = MakeRequest();
  for (int i = 0; i < 10000; ++i) {
    request.add_outputs();
  }
  const grpc::Status status = RenderAll(request);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), ::testing::StartsWith("message: one that takes "));
  v1::FindMissingParticlesRequest question;
  for (int i = 0; i < 10000; ++i) {
    question.add_sha256();
  }
  grpc::ClientContext context;
  v1::FindMissingParticlesResponse missing;
  EXPECT_THAT(stub_->FindMissingParticles(&context, question, &missing).error_message(),
              ::testing::StartsWith("message: one that takes "));
  v1::UploadParticlesRequest upload;
  for (int i = 0; i < 300000; ++i) {
    upload.mutable_header()->mutable_layout()->add_attributes(v1::PARTICLE_ATTRIBUTE_RADIUS);
  }
  EXPECT_THAT(Send("UploadParticles", {upload.SerializeAsString()}).error_message(),
              ::testing::StartsWith("message: one that takes "));
  // What particles take is as much as they are sent in.
  *request.mutable_outputs() = MakeRequest().outputs();
  *request.mutable_scene()->mutable_inline_particles() =
      MakeParticles(100000, {v1::PARTICLE_ATTRIBUTE_POSITION});
  request.mutable_scene()->mutable_material()->set_radius(0.1F);
  EXPECT_TRUE(RenderAll(request).ok());
}

TEST_F(Service, InvalidRequestNamesTheField) {
  v1::RenderFrameRequest request = MakeRequest();
  request.mutable_scene()->mutable_camera()->mutable_perspective()->set_vertical_fov_deg(200);
  const grpc::Status status = RenderAll(request);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(),
            "scene.camera.perspective.vertical_fov_deg: 200, allowed: [1e-06, 179)");
}

TEST_F(Service, DrainFinishesWhatRunsAndRefusesTheRest) {
  engine_.SetGate(false);
  std::jthread running([this] { EXPECT_TRUE(RenderAll(MakeRequest()).ok()); });
  ASSERT_TRUE(WaitFor([this] { return engine_.waiting() == 1; }));
  server_->BeginDrain();
  EXPECT_EQ(RenderAll(MakeRequest()).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_FALSE(server_->idle());
  engine_.SetGate(true);
  running.join();
  EXPECT_TRUE(WaitFor([this] { return server_->idle(); }));
}

TEST_F(Service, CallsThatADrainRefusesDoNotHoldItUp) {
  ASSERT_TRUE(RenderAll(MakeRequest()).ok());  // so that there is a connection
  ASSERT_TRUE(WaitFor([this] { return server_->idle(); }));
  server_->BeginDrain();
  std::atomic<int> refused = 0;
  std::vector<std::jthread> clients;
  for (int i = 0; i < 16; ++i) {
    clients.emplace_back([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        refused += RenderAll(MakeRequest()).error_code() == grpc::StatusCode::UNAVAILABLE ? 1 : 0;
      }
    });
  }
  int looks = 0;
  int busy = 0;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (refused < 2000 && std::chrono::steady_clock::now() < until) {
    ++looks;
    busy += server_->idle() ? 0 : 1;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  EXPECT_GE(refused, 2000);
  EXPECT_LT(busy, looks / 3) << "while one is refused, and not until its peer knows";
}

TEST_F(Service, SecondServerOnTheSamePortIsRefused) {
  const auto second = GrpcServer::Start(server_->addresses(), backend_);
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(server_->addresses()[0]));
}

// One bytes request and one bytes answer on a stream of a service whose stubs are not built here.
std::string AskOnce(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                    const std::string& request) {
  grpc::GenericStub generic(channel);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  auto call = generic.PrepareCall(&context, method, &queue);
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    return ok;
  };
  call->StartCall(nullptr);
  wait();
  const grpc::Slice slice(request);
  call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
  wait();
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  std::string bytes;
  if (wait()) {
    std::vector<grpc::Slice> slices;
    answer.Dump(&slices);
    for (const grpc::Slice& part : slices) {
      bytes.append(reinterpret_cast<const char*>(part.begin()), part.size());
    }
  }
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return bytes;
}

TEST_F(Service, ReflectionTellsOfTheServiceAndHealth) {
  // ServerReflectionRequest { list_services = 7: "" }.
  const std::string listed =
      AskOnce(channel_, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
              std::string("\x3a\x00", 2));
  EXPECT_THAT(listed, HasSubstr("halflight.v1.RenderService"));
  EXPECT_THAT(listed, HasSubstr("grpc.health.v1.Health"));
  // { file_containing_symbol = 4 }: what is listed can be called by who knows nothing else.
  const std::string described =
      AskOnce(channel_, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
              "\x22\x15grpc.health.v1.Health");
  EXPECT_THAT(described, HasSubstr("HealthCheckResponse"));
}

// HealthCheckRequest { service = 1 }, of the whole server and of the service.
std::vector<std::string> Healths(const std::shared_ptr<grpc::Channel>& channel) {
  std::vector<std::string> answers;
  for (const std::string service : {"", "halflight.v1.RenderService"}) {
    const std::string request =
        "\x0a" + std::string(1, static_cast<char>(service.size())) + service;
    answers.push_back(AskOnce(channel, "/grpc.health.v1.Health/Check", request));
  }
  return answers;
}

TEST_F(Service, HealthTurnsWhenTheDrainBegins) {
  // HealthCheckResponse { status = 1 }: SERVING is 1, NOT_SERVING 2.
  EXPECT_THAT(Healths(channel_), ElementsAre("\x08\x01", "\x08\x01"));
  EXPECT_TRUE(server_->serving());
  server_->BeginDrain();
  EXPECT_THAT(Healths(channel_), ElementsAre("\x08\x02", "\x08\x02"));
  EXPECT_FALSE(server_->serving());
}

// The name that a call has, as its initial metadata say.
std::string NameOfCall(const grpc::ClientContext& context) {
  const auto found = context.GetServerInitialMetadata().find("x-request-id");
  return found == context.GetServerInitialMetadata().end()
             ? ""
             : std::string(found->second.data(), found->second.size());
}

TEST_F(Service, CallHasTheNameThatItsClientGaveIt) {
  struct Case {
    std::string metadata;
    std::string field;
    std::string call;   // "": a new one
    std::string frame;  // "": the call's
  };
  const std::string too_long(129, 'x');
  for (const Case& named :
       {Case{"", "", "", ""}, Case{"by metadata", "", "by metadata", ""},
        Case{"", "by field", "by field", ""},
        Case{"by metadata", "by field", "by metadata", "by field"},
        Case{too_long, "by field", "by field", ""}, Case{too_long, "", "", ""}}) {
    grpc::ClientContext context;
    if (!named.metadata.empty()) {
      context.AddMetadata("x-request-id", named.metadata);
    }
    v1::RenderFrameRequest request = MakeRequest();
    request.set_request_id(named.field);
    auto reader = stub_->RenderFrame(&context, request);
    v1::RenderFrameResponse response;
    std::string frame;
    while (reader->Read(&response)) {
      frame = response.has_header() ? response.header().metadata().request_id() : frame;
    }
    EXPECT_TRUE(reader->Finish().ok());
    const std::string call = NameOfCall(context);
    if (named.call.empty()) {
      EXPECT_THAT(call, ::testing::MatchesRegex("[0-9a-f]{16}-[0-9]+"));
    } else {
      EXPECT_EQ(call, named.call);
    }
    EXPECT_EQ(frame, named.frame.empty() ? call : named.frame);
  }
}

TEST_F(Service, RefusedCallsUploadsAndQuestionsHaveNamesToo) {
  engine_.RefuseWith(absl::UnavailableError("not now"));
  {
    grpc::ClientContext context;
    context.AddMetadata("x-request-id", "refused");
    auto reader = stub_->RenderFrame(&context, {});
    v1::RenderFrameResponse response;
    EXPECT_FALSE(reader->Read(&response));
    EXPECT_FALSE(reader->Finish().ok());
    EXPECT_EQ(NameOfCall(context), "refused");
  }
  {
    grpc::ClientContext context;
    context.AddMetadata("x-request-id", "upload");
    v1::UploadParticlesResponse response;
    const auto writer = stub_->UploadParticles(&context, &response);
    writer->WritesDone();
    EXPECT_FALSE(writer->Finish().ok());
    EXPECT_EQ(NameOfCall(context), "upload");
  }
  server_->BeginDrain();
  grpc::ClientContext context;
  context.AddMetadata("x-request-id", "question");
  v1::GetServerInfoResponse info;
  EXPECT_FALSE(stub_->GetServerInfo(&context, {}, &info).ok());
  EXPECT_EQ(NameOfCall(context), "question");
}

TEST_F(Service, FramesOfASequenceAreNumberedWhereTheyHaveNoNames) {
  grpc::ClientContext context;
  context.AddMetadata("x-request-id", "shot");
  auto stream = stub_->RenderSequence(&context);
  for (const char* name : {"", "mine", ""}) {
    v1::RenderSequenceRequest request;
    *request.mutable_frame() = MakeRequest();
    request.mutable_frame()->set_request_id(name);
    stream->Write(request);
  }
  stream->WritesDone();
  std::vector<std::string> names;
  v1::RenderSequenceResponse response;
  while (stream->Read(&response)) {
    if (response.has_header()) {
      names.push_back(response.header().metadata().request_id());
    }
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(names, (std::vector<std::string>{"shot.0", "mine", "shot.2"}));
}

}  // namespace
}  // namespace halflight
