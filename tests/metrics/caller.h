// A client of halflightd that says who it is, what its call is called, and what it cost.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "halflight/v1/service.grpc.pb.h"

namespace halflight::testing {

// What became of one call.
struct CallEnd {
  grpc::Status status{};
  uint64_t received_bytes = 0;  // of messages, by the client
  std::string request_id{};     // as the server says
};

class TestCaller {
 public:
  TestCaller(const std::string& address, std::string token)
      : stub_(v1::RenderService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))),
        token_(std::move(token)) {}

  v1::RenderService::Stub& stub() { return *stub_; }

  void Prepare(grpc::ClientContext& context, const std::string& request_id = "") const {
    context.set_wait_for_ready(true);
    if (!token_.empty()) {
      context.AddMetadata("authorization", "Bearer " + token_);
    }
    if (!request_id.empty()) {
      context.AddMetadata("x-request-id", request_id);
    }
  }

  // Finishes a frame that was begun.
  static CallEnd Finish(grpc::ClientContext& context,
                        grpc::ClientReader<v1::RenderFrameResponse>& reader) {
    CallEnd end;
    v1::RenderFrameResponse response;
    while (reader.Read(&response)) {
      end.received_bytes += response.ByteSizeLong();
    }
    end.status = reader.Finish();
    end.request_id = NameIn(context);
    return end;
  }

  CallEnd Render(const v1::RenderFrameRequest& request, const std::string& request_id = "") {
    grpc::ClientContext context;
    Prepare(context, request_id);
    return Finish(context, *stub_->RenderFrame(&context, request));
  }

  // Sends messages; `whole`: then says that there are no more, else breaks off as soon as `taken`
  // holds.
  CallEnd Upload(const std::vector<v1::UploadParticlesRequest>& messages,
                 const std::function<bool()>& taken = {}, const std::string& request_id = "") {
    grpc::ClientContext context;
    Prepare(context, request_id);
    v1::UploadParticlesResponse response;
    const auto writer = stub_->UploadParticles(&context, &response);
    for (const v1::UploadParticlesRequest& message : messages) {
      writer->Write(message);
    }
    if (taken) {
      taken();
      context.TryCancel();
    } else {
      writer->WritesDone();
    }
    CallEnd end{.status = writer->Finish()};
    end.request_id = NameIn(context);
    return end;
  }

 private:
  static std::string NameIn(const grpc::ClientContext& context) {
    const auto found = context.GetServerInitialMetadata().find("x-request-id");
    return found == context.GetServerInitialMetadata().end()
               ? ""
               : std::string(found->second.data(), found->second.size());
  }

  std::unique_ptr<v1::RenderService::Stub> stub_;
  std::string token_;
};

}  // namespace halflight::testing
