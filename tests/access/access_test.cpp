// Who gets in, through a real gRPC server in this process: certificates, tokens, both reloaded
// while calls go on, and everybody else refused.

#include "server/access/access.h"

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "client/client.h"
#include "halflight/sha256.h"
#include "halflight/v1/service.grpc.pb.h"
#include "server/grpc_server.h"
#include "tests/access/certificates.h"
#include "tests/access/health.h"
#include "tests/process/process.h"
#include "tests/process/wait_for.h"
#include "tests/server/fake_engine.h"
#include "tests/server/made_particles.h"
#include "tests/server/upload_messages.h"

namespace halflight {
namespace {

using testing::Authority;
using testing::CallRaw;
using testing::EncodePlain;
using testing::FakeEngine;
using testing::Folder;
using ::testing::HasSubstr;
using testing::Health;
using testing::Issued;
using testing::kServing;
using testing::MakeRequest;
using testing::NewChannel;
using testing::WaitFor;

constexpr const char* kService = "/halflight.v1.RenderService/";

class AccessTest : public ::testing::Test {
 protected:
  void Serve(const AccessOptions& options) {
    auto access = Access::Load(options);
    ASSERT_TRUE(access.ok()) << access.status();
    access_ = *std::move(access);
    auto sockets = ListeningSocket::Bind("127.0.0.1:0");
    ASSERT_TRUE(sockets.ok()) << sockets.status();
    auto server = GrpcServer::Start(*std::move(sockets), *access_, backend_);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    address_ = server_->addresses()[0];
  }

  // A client certificate's files, for the options of a client.
  client::Security Show(const Issued& issued) const {
    return {.ca_file = folder_.Write("server-ca.pem", authority_.certificate()),
            .cert_file = folder_.Write("client.pem", issued.certificate),
            .key_file = folder_.Write("client.key", issued.key)};
  }
  [[nodiscard]] client::Security TrustServer() const {
    return {.ca_file = folder_.Write("server-ca.pem", authority_.certificate())};
  }

  TlsPaths WriteServer(const Issued& issued, const std::string& client_authorities = "") const {
    return {folder_.Write("server.pem", issued.certificate),
            folder_.Write("server.key", issued.key),
            client_authorities.empty() ? "" : folder_.Write("ca.pem", client_authorities)};
  }
  // One token each, "<tenant>'s token".
  [[nodiscard]] std::string WriteTokens(const std::vector<std::string>& tenants) const {
    std::string text;
    for (const std::string& tenant : tenants) {
      text += ToHex(Sha256Of(tenant + "'s-token")) + " " + tenant + "\n";
    }
    return folder_.Write("tokens", text);
  }

  [[nodiscard]] absl::Status Ask(client::Security security, const std::string& token = "") const {
    client::ClientOptions options;
    options.max_attempts = 1;
    options.timeout = std::chrono::seconds(20);
    options.security = std::move(security);
    options.security.token = token;
    auto client = client::Client::Connect(address_, options);
    return client.ok() ? client->GetServerInfo().status() : client.status();
  }
  [[nodiscard]] absl::StatusCode CodeWith(const client::Security& security,
                                          const std::string& token = "") const {
    return Ask(security, token).code();
  }

  const Folder folder_;
  const Authority authority_;
  FakeEngine engine_;
  ServerLimits limits_;
  std::string version_ = "1";
  ParticleStore store_{1 << 20};
  ByteBudget upload_memory_{1 << 20};
  PartialUploads partial_uploads_{upload_memory_, {}};
  FramePipeline pipeline_{
      engine_, {.admission = {.max_queued_frames = 8}, .encode_threads = 2, .encode = EncodePlain}};
  Backend backend_{engine_.device(), limits_, version_, store_, partial_uploads_, pipeline_};
  std::unique_ptr<Access> access_;
  std::unique_ptr<GrpcServer> server_;
  std::string address_;
};

TEST_F(AccessTest, TokensAreWantedOfEveryCallButHealthAndReflection) {
  Serve({.token_file = WriteTokens({"alice", "bob"})});
  EXPECT_TRUE(Ask({}, "bob's-token").ok());
  EXPECT_EQ(CodeWith({}, "eve's-token"), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(CodeWith({}), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(CodeWith({}, "bob's-token "), absl::StatusCode::kInvalidArgument);

  const auto channel = NewChannel(address_);
  for (const char* method : {"GetServerInfo", "FindMissingParticles", "UploadParticles",
                             "RenderFrame", "RenderSequence"}) {
    EXPECT_EQ(CallRaw(channel, std::string(kService) + method, "").status.error_code(),
              grpc::StatusCode::UNAUTHENTICATED)
        << method;
  }
  EXPECT_EQ(Health(channel), kServing);
  EXPECT_TRUE(CallRaw(channel, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                      std::string("\x3a\x00", 2))
                  .status.ok());
  EXPECT_EQ(engine_.rendered(), 0);
}

// What is cancelled while its refusal is on its way ends once.
TEST_F(AccessTest, RefusedCallsMayBeCancelledAtAnyMoment) {
  Serve({.token_file = WriteTokens({"alice"})});
  const auto stub = v1::RenderService::NewStub(NewChannel(address_));
  for (int i = 0; i < 500; ++i) {
    grpc::ClientContext sequence;
    const auto stream = stub->RenderSequence(&sequence);
    grpc::ClientContext frame;
    const auto reader = stub->RenderFrame(&frame, MakeRequest());
    grpc::ClientContext upload;
    v1::UploadParticlesResponse response;
    const auto writer = stub->UploadParticles(&upload, &response);
    if (i % 5 > 0) {
      std::this_thread::sleep_for(std::chrono::microseconds(40 * (i % 5)));
    }
    sequence.TryCancel();
    frame.TryCancel();
    upload.TryCancel();
    EXPECT_FALSE(stream->Finish().ok());
    EXPECT_FALSE(reader->Finish().ok());
    EXPECT_FALSE(writer->Finish().ok());
  }
  EXPECT_TRUE(Ask({}, "alice's-token").ok());
  EXPECT_TRUE(WaitFor([this] { return server_->idle(); }));
}

TEST_F(AccessTest, OneBearerTokenIsAllThatCounts) {
  Serve({.token_file = WriteTokens({"alice"})});
  const auto stub = v1::RenderService::NewStub(NewChannel(address_));
  const auto code = [&](const std::vector<std::string>& values) {
    grpc::ClientContext context;
    for (const std::string& value : values) {
      context.AddMetadata("authorization", value);
    }
    v1::GetServerInfoResponse response;
    return stub->GetServerInfo(&context, {}, &response).error_code();
  };
  EXPECT_EQ(code({"Bearer alice's-token"}), grpc::StatusCode::OK);
  EXPECT_EQ(code({"bearer alice's-token"}), grpc::StatusCode::OK);
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"alice's-token"},
                                                {"Basic alice's-token"},
                                                {"Bearer"},
                                                {"Bearer "},
                                                {"Bearer alice's-token", "Bearer alice's-token"},
                                                {"Bearer nobody's-token", "Bearer alice's-token"},
                                                {"Bearer " + ToHex(Sha256Of("alice's-token"))},
                                                {"Bearer alice's-tokenx"}}) {
    EXPECT_EQ(code(wrong), grpc::StatusCode::UNAUTHENTICATED) << wrong[0];
  }
}

TEST_F(AccessTest, WhatBrokeOffOfAnUploadIsItsTenantsAlone) {
  Serve({.token_file = WriteTokens({"alice", "bob"})});
  const auto stub = v1::RenderService::NewStub(NewChannel(address_));
  const v1::InlineParticles particles =
      testing::MakeParticles(100, {v1::PARTICLE_ATTRIBUTE_POSITION});
  const v1::ParticleSetDescription header = testing::Describe(particles);
  {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer alice's-token");
    v1::UploadParticlesResponse response;
    const auto upload = stub->UploadParticles(&context, &response);
    upload->Write(testing::Header(header));
    upload->Write(testing::Chunk(particles.payload().substr(0, 600)));
    upload->WritesDone();
    EXPECT_EQ(upload->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
  const auto committed = [&](const std::string& tenant) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + tenant + "'s-token");
    v1::QueryUploadRequest request;
    request.set_sha256(header.sha256());
    v1::QueryUploadResponse response;
    EXPECT_TRUE(stub->QueryUpload(&context, request, &response).ok());
    return response.committed_bytes();
  };
  EXPECT_EQ(committed("bob"), 0U);
  EXPECT_EQ(committed("alice"), 600U);
}

TEST_F(AccessTest, TenantWithAllItsCallsUnderWayIsRefusedAndOthersAreNot) {
  limits_.max_client_calls = 2;
  Serve({.token_file = WriteTokens({"alice", "bob"})});
  {
    // Calls that go on for as long as their client likes.
    const auto stub = v1::RenderService::NewStub(NewChannel(address_));
    grpc::ClientContext contexts[2];
    std::vector<std::unique_ptr<
        grpc::ClientReaderWriter<v1::RenderSequenceRequest, v1::RenderSequenceResponse>>>
        calls;
    for (grpc::ClientContext& context : contexts) {
      context.AddMetadata("authorization", "Bearer alice's-token");
      calls.push_back(stub->RenderSequence(&context));
    }
    ASSERT_TRUE(WaitFor([this] { return server_->calls(Rpc::kRenderSequence) == 2; }));
    const absl::Status refused = Ask({}, "alice's-token");
    EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_THAT(std::string(refused.message()),
                HasSubstr("2 calls of this client are under way, allowed: at most 2"));
    EXPECT_TRUE(Ask({}, "bob's-token").ok());
    for (const auto& call : calls) {
      call->WritesDone();
      EXPECT_TRUE(call->Finish().ok());
    }
  }
  EXPECT_TRUE(WaitFor([this] { return Ask({}, "alice's-token").ok(); }));
}

TEST_F(AccessTest, ErrorsSayWhatIsWantedAndNoToken) {
  Serve({.token_file = WriteTokens({"alice"})});
  const absl::Status status = Ask({}, "secret");
  EXPECT_THAT(std::string(status.message()), HasSubstr("authorization: the token is not known"));
  EXPECT_THAT(std::string(status.message()), ::testing::Not(HasSubstr("secret")));
}

TEST_F(AccessTest, ClientsBelieveOnlyTheServerThatTheirAuthorityKnows) {
  Serve({.tls = WriteServer(authority_.IssueServer())});
  EXPECT_TRUE(Ask(TrustServer()).ok());
  const Authority other;
  EXPECT_EQ(CodeWith({.ca_file = folder_.Write("other.pem", other.certificate())}),
            absl::StatusCode::kUnavailable);
  EXPECT_EQ(CodeWith({.tls = true}), absl::StatusCode::kUnavailable) << "the system knows it not";
}

TEST_F(AccessTest, ServersCertificateIsForItsHost) {
  Serve({.tls = WriteServer(
             authority_.Issue({.common_name = "127.0.0.1", .alternate = {"DNS:elsewhere"}}))});
  EXPECT_EQ(CodeWith(TrustServer()), absl::StatusCode::kUnavailable);
}

TEST_F(AccessTest, PlainTextAndTlsDoNotMeet) {
  Serve({.tls = WriteServer(authority_.IssueServer())});
  EXPECT_EQ(CodeWith({}), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(Ask(TrustServer()).ok()) << "the server suffered";
  server_.reset();
  Serve({});
  EXPECT_EQ(CodeWith(TrustServer()), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(Ask({}).ok()) << "the server suffered";
}

TEST_F(AccessTest, ClientCertificatesAreThoseOfTheClientAuthoritiesAlone) {
  const Authority clients;
  Serve({.tls = WriteServer(authority_.IssueServer(), clients.certificate())});
  EXPECT_TRUE(Ask(Show(clients.Issue({.common_name = "alice"}))).ok());
  EXPECT_EQ(CodeWith(Show(authority_.Issue({.common_name = "alice"}))),
            absl::StatusCode::kUnavailable);
  EXPECT_EQ(CodeWith(Show(clients.Issue(
                {.common_name = "alice", .valid_from_seconds = -20, .valid_until_seconds = -10}))),
            absl::StatusCode::kUnavailable);
  EXPECT_EQ(CodeWith(TrustServer()), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(CodeWith(Show(clients.Issue({.common_name = "", .alternate = {"IP:127.0.0.1"}}))),
            absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(CodeWith(Show(clients.Issue({.common_name = "two words"}))),
            absl::StatusCode::kUnauthenticated);
  // Load balancers have none.
  EXPECT_EQ(Health(NewChannel(address_, grpc::SslCredentials({authority_.certificate(), "", ""}))),
            kServing);
}

TEST_F(AccessTest, TokenOrCertificateWillDo) {
  const Authority clients;
  Serve({.tls = WriteServer(authority_.IssueServer(), clients.certificate()),
         .token_file = WriteTokens({"bob"})});
  const client::Security certificate = Show(clients.Issue({.common_name = "alice"}));
  EXPECT_TRUE(Ask(TrustServer(), "bob's-token").ok());
  EXPECT_TRUE(Ask(certificate).ok());
  EXPECT_TRUE(Ask(certificate, "bob's-token").ok());
  // A wrong one is not made good by the other.
  EXPECT_EQ(CodeWith(certificate, "eve's-token"), absl::StatusCode::kUnauthenticated);
}

TEST_F(AccessTest, TokensChangeUnderRunningCalls) {
  Serve({.token_file = WriteTokens({"alice"})});
  engine_.SetGate(false);
  absl::Status running = absl::UnknownError("");
  std::jthread call([&] {
    client::ClientOptions options;
    options.security.token = "alice's-token";
    auto client = client::Client::Connect(address_, options);
    running = client->RenderFrame(MakeRequest()).status();
  });
  ASSERT_TRUE(WaitFor([&] { return engine_.waiting() == 1; }));

  [[maybe_unused]] const auto path = WriteTokens({"bob"});
  EXPECT_TRUE(WaitFor([&] { return Ask({}, "bob's-token").ok(); }));
  EXPECT_EQ(CodeWith({}, "alice's-token"), absl::StatusCode::kUnauthenticated);

  engine_.SetGate(true);
  call.join();
  EXPECT_TRUE(running.ok()) << running;
}

TEST_F(AccessTest, DamagedTokensChangeNothing) {
  Serve({.token_file = WriteTokens({"alice"})});
  const std::string damaged = folder_.Write("tokens", "damaged\n");
  // Two looks at the files, after which the change must have been seen.
  std::this_thread::sleep_for(std::chrono::milliseconds(2200));
  EXPECT_TRUE(Ask({}, "alice's-token").ok());
  unlink(damaged.c_str());
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  EXPECT_TRUE(Ask({}, "alice's-token").ok());
  [[maybe_unused]] const auto path = WriteTokens({"bob"});
  EXPECT_TRUE(WaitFor([&] { return Ask({}, "bob's-token").ok(); }));
}

TEST_F(AccessTest, CertificatesChangeUnderRunningCalls) {
  const Authority clients;
  const Authority next;
  const client::Security old_trust = Show(clients.Issue({.common_name = "a"}));
  Serve({.tls = WriteServer(authority_.IssueServer(), clients.certificate())});
  client::ClientOptions options;
  options.security = old_trust;
  auto client = client::Client::Connect(address_, options);
  ASSERT_TRUE(client.ok()) << client.status();
  engine_.SetGate(false);
  absl::Status running = absl::UnknownError("");
  std::jthread call([&] { running = client->RenderFrame(MakeRequest()).status(); });
  ASSERT_TRUE(WaitFor([&] { return engine_.waiting() == 1; }));

  WriteServer(next.IssueServer(), clients.certificate());
  client::Security new_trust = old_trust;
  new_trust.ca_file = folder_.Write("next.pem", next.certificate());
  EXPECT_TRUE(WaitFor([&] { return Ask(new_trust).ok(); }));
  EXPECT_EQ(CodeWith(old_trust), absl::StatusCode::kUnavailable);

  engine_.SetGate(true);
  call.join();
  EXPECT_TRUE(running.ok()) << running;
  EXPECT_TRUE(client->GetServerInfo().ok()) << "the old connection is not of use any more";

  // Other clients are believed from now on.
  WriteServer(next.IssueServer(), next.certificate());
  EXPECT_TRUE(WaitFor([&] { return CodeWith(new_trust) == absl::StatusCode::kUnavailable; }));
}

TEST_F(AccessTest, DamagedCertificatesChangeNothing) {
  const Issued issued = authority_.IssueServer();
  Serve({.tls = WriteServer(issued)});
  for (const Issued& wrong : {Issued{"damaged", issued.key}, Issued{issued.certificate, "damaged"},
                              Issued{issued.certificate, authority_.IssueServer().key}}) {
    WriteServer(wrong);
    std::this_thread::sleep_for(std::chrono::milliseconds(2200));
    EXPECT_TRUE(Ask(TrustServer()).ok());
  }
}

TEST_F(AccessTest, WhatCannotBeReadAtTheStartIsAnError) {
  const auto error = [](const AccessOptions& options) {
    return std::string(Access::Load(options).status().message());
  };
  EXPECT_THAT(error({.token_file = folder_ / "none"}), HasSubstr("--token-file: "));
  EXPECT_THAT(error({.token_file = folder_.Write("empty", "")}), HasSubstr("--token-file: "));
  EXPECT_THAT(error({.tls = {"nowhere", "nowhere", ""}}), HasSubstr("nowhere"));
}

TEST_F(AccessTest, OtherMachinesAreKeptOutUnlessCallsAreSecure) {
  // Bound, but nobody can connect before it listens.
  auto open = ListeningSocket::Bind("0.0.0.0:0");
  ASSERT_TRUE(open.ok()) << open.status();
  auto closed = ListeningSocket::BindAll({"127.0.0.1:0", "unix:" + folder_ / "socket"});
  ASSERT_TRUE(closed.ok()) << closed.status();
  const auto access = [](const AccessOptions& options) { return *Access::Load(options); };
  const auto none = access({});
  const auto tokens = access({.token_file = WriteTokens({"a"})});
  const auto tls = access({.tls = WriteServer(authority_.IssueServer())});
  const auto both =
      access({.tls = WriteServer(authority_.IssueServer()), .token_file = WriteTokens({"a"})});
  const auto mutual =
      access({.tls = WriteServer(authority_.IssueServer(), authority_.certificate())});
  for (const Access* weak : {none.get(), tokens.get(), tls.get()}) {
    EXPECT_TRUE(CheckReach(*closed, *weak, false).ok());
    const absl::Status status = CheckReach(*open, *weak, false);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr("--insecure-listen"));
    EXPECT_THAT(std::string(status.message()), HasSubstr(open->front().address()));
    EXPECT_TRUE(CheckReach(*open, *weak, true).ok());
  }
  EXPECT_TRUE(CheckReach(*open, *both, false).ok());
  EXPECT_TRUE(CheckReach(*open, *mutual, false).ok());
}

}  // namespace
}  // namespace halflight
