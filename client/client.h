// The client of the render service: one method a call, with deadlines, retries and checks.
// Leaves out files (readers/), what a request should say (framing.h) and starting a server
// (local_server.h).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/frame_assembler.h"
#include "client/particles.h"
#include "halflight/v1/service.pb.h"

namespace halflight::client {

// How client and server know each other.
struct Security {
  // Whether to encrypt, and to believe only a server whose certificate is for the host of its
  // address. Any of the files below means so too.
  bool tls = false;
  std::string ca_file{};    // the authorities to believe, PEM; empty: the system's
  std::string cert_file{};  // what to show, PEM; with key_file
  std::string key_file{};
  // Who calls, where the server wants to know; empty: not said. It is kept out of every message.
  std::string token{};
  // Whether the token may also go in plain text to other machines.
  bool insecure_token = false;
};

struct ClientOptions {
  // The longest that a call may take, retries included; of a sequence, the longest without a sign
  // of life. 0: for ever.
  std::chrono::milliseconds timeout{600000};
  // Tries of one call before its error is returned.
  int max_attempts = 6;
  // The first wait between tries; it doubles from one to the next.
  std::chrono::milliseconds first_backoff{100};
  // The most that the outputs of one frame may come to, so that no server fills the memory.
  uint64_t max_frame_bytes = uint64_t{16} << 30;
  // When requested, calls end with CANCELLED at once.
  std::stop_token stop;
  Security security;
};

// What uploads cost so far, payload bytes.
struct UploadTotals {
  uint64_t sent_bytes = 0;   // given to the connection, also of uploads that broke off
  uint64_t saved_bytes = 0;  // not sent because the server had them of an upload that broke off
};

// One frame of a sequence, before it is sent.
struct SequenceFrame {
  v1::RenderFrameRequest request;
  // Uploaded where the server lacks them; the request then names them.
  std::optional<EncodedParticles> particles;
};

// Gives frame `index`. Called from other threads than the caller's too, but from one at a time, in
// ascending order; again for frames that have to be sent again.
using FrameSource = std::function<absl::StatusOr<SequenceFrame>(uint64_t index)>;
// Takes frame `index`; called on the caller's thread, in ascending order, once each.
using FrameSink = std::function<absl::Status(uint64_t index, RenderedFrame frame)>;

// May be used from several threads at once. Errors are those that service.proto lists, DATA_LOSS
// where what came does not fit together or was not asked for, and OUT_OF_RANGE beyond
// max_frame_bytes. UNAVAILABLE, which a call that the server cancels ends with too, and the
// RESOURCE_EXHAUSTED that passes are returned only after max_attempts; CANCELLED only where stop
// was requested.
class Client {
 public:
  // `address` is host:port or unix:path; InvalidArgument for anything else, and for security that
  // cannot be had as it is asked for. Does not wait for the server: the first call does.
  static absl::StatusOr<Client> Connect(const std::string& address, ClientOptions options = {});
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  // Waits for a connection, `time` at most; false where there is none by then.
  bool WaitForConnection(std::chrono::milliseconds time);

  absl::StatusOr<v1::GetServerInfoResponse> GetServerInfo();

  // Those of the named sets that the server lacks.
  absl::StatusOr<std::vector<std::string>> FindMissing(const std::vector<std::string>& sha256);

  // Sends a set where the server lacks it, and of it what the server lacks: each try goes on where
  // an earlier one broke off, be it one of another process. InvalidArgument where it is larger than
  // the server takes.
  absl::Status EnsureUploaded(const EncodedParticles& particles);

  // Of all uploads by this client, those of sequences included.
  [[nodiscard]] UploadTotals upload_totals() const;

  // Renders one frame. With `particles` they are uploaded first and named in the request; where the
  // server has dropped them in between they are sent once more.
  absl::StatusOr<RenderedFrame> RenderFrame(v1::RenderFrameRequest request,
                                            const EncodedParticles* particles = nullptr);

  // Renders `count` frames over one stream. At most `read_ahead` frames are sent beyond the one
  // that is awaited. A stream that breaks off for a reason worth a retry goes on where it stopped.
  // An error or exception of `source` is returned after all frames before it were taken; an error
  // of `sink` at once. How the stream ends does not matter once all frames were taken. Where the
  // server refuses a frame the message starts with "frame N: ", N counted from 0.
  absl::Status RenderSequence(uint64_t count, const FrameSource& source, const FrameSink& sink,
                              uint32_t read_ahead = 4);

 private:
  class Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace halflight::client
