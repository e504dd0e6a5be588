#include "client/client.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/client_impl.h"
#include "client/frame_calls.h"
#include "client/frame_reader.h"
#include "client/readers/text.h"
#include "client/security.h"
#include "client/status_text.h"
#include "halflight/sha256.h"

namespace halflight::client {

namespace {

constexpr size_t kUploadChunkBytes = size_t{256} << 10;
// Chunks are far smaller; headers grow with outputs and layers.
constexpr int kMaxReceivedBytes = 64 << 20;
// gRPC keeps deadlines in whole milliseconds of another clock.
constexpr std::chrono::milliseconds kRounding{10};

absl::Status CheckAddress(const std::string& address) {
  const bool is_unix = address.rfind("unix:", 0) == 0;
  const size_t colon = address.rfind(':');
  const auto port =
      colon == std::string::npos ? std::nullopt : ParseCount(address.substr(colon + 1));
  const bool is_tcp = !is_unix && colon != 0 && port && *port >= 1 && *port <= 65535;
  if (is_tcp || (is_unix && address.size() > 5)) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      fmt::format("address is '{}'; allowed: host:port or unix:path", address));
}

std::optional<std::chrono::milliseconds> HintOf(const grpc::ClientContext& context) {
  const auto& metadata = context.GetServerTrailingMetadata();
  const auto found = metadata.find("grpc-retry-pushback-ms");
  if (found == metadata.end()) {
    return std::nullopt;
  }
  const auto ms = ParseCount(std::string_view(found->second.data(), found->second.size()));
  return ms && *ms < 3600000 ? std::optional(std::chrono::milliseconds(*ms)) : std::nullopt;
}

}  // namespace

absl::Status FromGrpc(const grpc::Status& status, const grpc::ClientContext& context) {
  const auto code = status.error_code() == grpc::StatusCode::CANCELLED
                        ? absl::StatusCode::kUnavailable
                        : static_cast<absl::StatusCode>(status.error_code());
  return WithRetryHint(absl::Status(code, status.error_message()), HintOf(context));
}

void SetMetadata(grpc::ClientContext& context, std::string_view route, const std::string& token) {
  if (!route.empty()) {
    context.AddMetadata("halflight-particle-sha256", ToHex(route));
  }
  if (!token.empty()) {
    context.AddMetadata("authorization", "Bearer " + token);
  }
}

Client::Impl::Impl(const std::string& address,
                   const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                   ClientOptions options)
    : address_(address), options_(std::move(options)) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxReceivedBytes);
  // A render server is near: a web proxy in the environment is not meant for it.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // The channel must not wait longer to connect again than the retries here wait.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 250);
  // Despite its name, how long one attempt to connect may take.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 10000);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  channel_ = grpc::CreateCustomChannel(address, credentials, arguments);
  stub_ = v1::RenderService::NewStub(channel_);
}

bool Client::Impl::WaitForConnection(std::chrono::milliseconds time, const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kLookForStop{50};
  const auto end = Clock::now() + time;
  bool connected = false;
  do {
    connected = channel_->WaitForConnected(std::min(end, Clock::now() + kLookForStop));
  } while (!connected && Clock::now() < end && !stop.stop_requested());
  return connected;
}

bool Client::Impl::Pause(std::chrono::milliseconds time, const std::stop_token& stop) {
  const auto end = Clock::now() + time;
  WaitForConnection(time, stop);
  return SleepUnlessStopped(std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()), stop);
}

absl::Status Client::Impl::Try(std::string_view route, const std::stop_token& stop,
                               const std::function<absl::Status(grpc::ClientContext&)>& attempt) {
  const auto deadline = Clock::now() + options_.timeout;
  const bool has_deadline = options_.timeout.count() > 0;
  Backoff backoff(options_.first_backoff);
  for (int tries = 1;; ++tries) {
    grpc::ClientContext context;
    if (has_deadline) {
      context.set_deadline(deadline);
    }
    SetMetadata(context, route, options_.security.token);
    absl::Status status;
    {
      const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
      status = attempt(context);
    }
    if (stop.stop_requested() && !status.ok()) {
      return absl::CancelledError("interrupted");
    }
    // Before that it is the server's, whose message says more.
    if (status.code() == absl::StatusCode::kDeadlineExceeded && has_deadline &&
        Clock::now() + kRounding >= deadline) {
      return absl::DeadlineExceededError(
          fmt::format("timeout: {} s went by without an answer from {}; allowed: longer, or 0 for "
                      "no limit",
                      std::chrono::duration<double>(options_.timeout).count(), address_));
    }
    if (!IsRetryable(status)) {
      return status;
    }
    const auto wait = backoff.Next(RetryHint(status));
    if (tries >= options_.max_attempts || (has_deadline && Clock::now() + wait > deadline)) {
      return absl::Status(status.code(),
                          fmt::format("{}, after {} of {} tries: {}", address_, tries,
                                      options_.max_attempts, MessageOf(status)));
    }
    if (!Pause(wait, stop)) {
      return absl::CancelledError("interrupted");
    }
  }
}

absl::StatusOr<v1::GetServerInfoResponse> Client::Impl::GetServerInfo(const std::stop_token& stop) {
  v1::GetServerInfoResponse response;
  absl::Status status = Try("", stop, [&](grpc::ClientContext& context) {
    return FromGrpc(stub_->GetServerInfo(&context, v1::GetServerInfoRequest(), &response), context);
  });
  if (!status.ok()) {
    return status;
  }
  return response;
}

absl::StatusOr<std::vector<std::string>> Client::Impl::FindMissing(
    const std::vector<std::string>& sha256, std::string_view route, const std::stop_token& stop) {
  v1::FindMissingParticlesRequest request;
  request.mutable_sha256()->Add(sha256.begin(), sha256.end());
  v1::FindMissingParticlesResponse response;
  absl::Status status = Try(route, stop, [&](grpc::ClientContext& context) {
    return FromGrpc(stub_->FindMissingParticles(&context, request, &response), context);
  });
  if (!status.ok()) {
    return status;
  }
  return std::vector<std::string>(response.missing_sha256().begin(),
                                  response.missing_sha256().end());
}

absl::StatusOr<v1::QueryUploadResponse> Client::Impl::QueryUpload(
    const grpc::ClientContext& context, const std::string& sha256, std::string_view route,
    const std::stop_token& stop) {
  grpc::ClientContext query;
  query.set_deadline(context.deadline());
  SetMetadata(query, route, options_.security.token);
  const std::stop_callback cancel(stop, [&query] { query.TryCancel(); });
  v1::QueryUploadRequest request;
  request.set_sha256(sha256);
  v1::QueryUploadResponse response;
  absl::Status status = FromGrpc(stub_->QueryUpload(&query, request, &response), query);
  // A server from before uploads could be resumed tells after the header that it has the set.
  if (!status.ok() && status.code() != absl::StatusCode::kUnimplemented) {
    return status;
  }
  return response;
}

absl::Status Client::Impl::UploadFrom(uint64_t offset, grpc::ClientContext& context,
                                      const EncodedParticles& particles) {
  v1::UploadParticlesResponse response;
  const auto writer = stub_->UploadParticles(&context, &response);
  v1::UploadParticlesRequest message;
  v1::ParticleSetDescription& header = *message.mutable_header();
  *header.mutable_layout() = particles.layout;
  header.set_byte_size(particles.payload.size());
  header.set_sha256(particles.sha256);
  header.set_resume_offset(offset);
  bool open = writer->Write(message);
  // A write that fails means that the server has answered already, be it that it has the set.
  for (size_t at = offset; open && at < particles.payload.size(); at += kUploadChunkBytes) {
    const size_t bytes = std::min(kUploadChunkBytes, particles.payload.size() - at);
    message.set_chunk(particles.payload.data() + at, bytes);
    open = writer->Write(message);
    sent_bytes_ += open ? bytes : 0;
  }
  if (open) {
    message.mutable_finish()->set_byte_size(particles.payload.size());
    message.mutable_finish()->set_sha256(particles.sha256);
    if (writer->Write(message)) {
      writer->WritesDone();
    }
  }
  return FromGrpc(writer->Finish(), context);
}

absl::Status Client::Impl::EnsureUploaded(const EncodedParticles& particles, std::string_view route,
                                          const std::stop_token& stop) {
  bool from_start = false;
  return Try(route, stop, [&](grpc::ClientContext& context) -> absl::Status {
    const auto there = QueryUpload(context, particles.sha256, route, stop);
    if (!there.ok() || there->complete()) {
      return there.status();
    }
    const uint64_t offset =
        from_start ? 0 : std::min<uint64_t>(there->committed_bytes(), particles.payload.size());
    absl::Status status = UploadFrom(offset, context, particles);
    if (status.ok()) {
      saved_bytes_ += offset;
    } else if (offset > 0 && status.code() == absl::StatusCode::kDataLoss) {
      from_start = true;  // somebody else sent other bytes under this name
      return absl::UnavailableError(MessageOf(status));
    } else if (offset > 0 && status.code() == absl::StatusCode::kOutOfRange) {
      return absl::UnavailableError(MessageOf(status));  // gone since it was asked about
    }
    return status;
  });
}

absl::StatusOr<RenderedFrame> Client::Impl::RenderOnce(grpc::ClientContext& context,
                                                       const v1::RenderFrameRequest& request) {
  const auto reader = CallRenderFrame(*channel_, context, request);
  grpc::ByteBuffer bytes;
  IncomingMessage<v1::RenderFrameResponse> incoming;
  const v1::RenderFrameResponse& message = incoming.message;
  FrameAssembler assembler;
  bool complete = false;
  absl::Status status;
  while (status.ok() && reader->Read(&bytes)) {
    status = Read(bytes, incoming);
    if (!status.ok()) {
      break;
    }
    switch (message.part_case()) {
      case v1::RenderFrameResponse::kHeader:
        status = assembler.AddHeader(message.header(), request.outputs(), options_.max_frame_bytes);
        break;
      case v1::RenderFrameResponse::kChunk:
        status = assembler.AddChunk(message.chunk(), incoming.chunk_data);
        break;
      case v1::RenderFrameResponse::kTrailer:
        status = assembler.AddTrailer(message.trailer());
        complete = status.ok();
        break;
      default:
        break;  // a part that a later version of the service has added
    }
  }
  if (!status.ok()) {
    context.TryCancel();
    reader->Finish();
    return status;
  }
  status = FromGrpc(reader->Finish(), context);
  if (!status.ok()) {
    return status;
  }
  if (!complete) {
    return absl::DataLossError("the stream ended before the frame's trailer");
  }
  return assembler.Take();
}

absl::StatusOr<RenderedFrame> Client::Impl::RenderFrame(const v1::RenderFrameRequest& request) {
  absl::StatusOr<RenderedFrame> frame;
  absl::Status status =
      Try(request.scene().particle_sha256(), options_.stop, [&](grpc::ClientContext& context) {
        frame = RenderOnce(context, request);
        return frame.status();
      });
  if (!status.ok()) {
    return status;
  }
  return frame;
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

absl::StatusOr<Client> Client::Connect(const std::string& address, ClientOptions options) {
  if (absl::Status status = CheckAddress(address); !status.ok()) {
    return status;
  }
  const auto credentials = MakeCredentials(address, options.security);
  if (!credentials.ok()) {
    return credentials.status();
  }
  return Client(std::make_unique<Impl>(address, *credentials, std::move(options)));
}

bool Client::WaitForConnection(std::chrono::milliseconds time) {
  return impl_->WaitForConnection(time, impl_->options().stop);
}

absl::StatusOr<v1::GetServerInfoResponse> Client::GetServerInfo() {
  return impl_->GetServerInfo(impl_->options().stop);
}

absl::StatusOr<std::vector<std::string>> Client::FindMissing(
    const std::vector<std::string>& sha256) {
  return impl_->FindMissing(sha256, "", impl_->options().stop);
}

absl::Status Client::EnsureUploaded(const EncodedParticles& particles) {
  return impl_->EnsureUploaded(particles, particles.sha256, impl_->options().stop);
}

UploadTotals Client::upload_totals() const { return impl_->upload_totals(); }

absl::StatusOr<RenderedFrame> Client::RenderFrame(v1::RenderFrameRequest request,
                                                  const EncodedParticles* particles) {
  if (particles == nullptr) {
    return impl_->RenderFrame(request);
  }
  request.mutable_scene()->set_particle_sha256(particles->sha256);
  for (bool again = false;; again = true) {
    if (absl::Status status = EnsureUploaded(*particles); !status.ok()) {
      return status;
    }
    auto frame = impl_->RenderFrame(request);
    if (again || frame.status().code() != absl::StatusCode::kNotFound) {
      return frame;
    }
  }
}

absl::Status Client::RenderSequence(uint64_t count, const FrameSource& source,
                                    const FrameSink& sink, uint32_t read_ahead) {
  return impl_->RenderSequence(count, source, sink, read_ahead);
}

}  // namespace halflight::client
