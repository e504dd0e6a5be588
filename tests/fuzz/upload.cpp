// Uploads: the bytes are what two clients do, one step after the other, on a server with room for
// little. Whatever they do, only sets that are what they are called are found, memory is given
// back, and who uploads honestly afterwards gets through.
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "halflight/particle_payload.h"
#include "halflight/v1/particles.pb.h"
#include "server/byte_budget.h"
#include "server/limits.h"
#include "server/partial_uploads.h"
#include "server/particle_store.h"
#include "server/particle_upload.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/require.h"
#include "tests/server/made_particles.h"
#include "tests/server/upload_messages.h"

namespace halflight::fuzz {
namespace {

constexpr size_t kClients = 2;
constexpr int kMaxSteps = 64;
constexpr uint64_t kStoreBytes = 150;  // of sets of 12 to 96 bytes
constexpr uint64_t kMemoryBytes = 200;
constexpr uint64_t kClientBytes = 120;

struct NamedSet {
  v1::InlineParticles particles;
  v1::ParticleSetDescription header;
  bool valid = true;
};

NamedSet MakeSet(int count, const std::vector<v1::ParticleAttribute>& attributes) {
  NamedSet set{testing::MakeParticles(count, attributes), {}};
  set.header = testing::Describe(set.particles);
  return set;
}

std::vector<NamedSet> MakeSets() {
  std::vector<NamedSet> sets;
  sets.push_back(MakeSet(1, {v1::PARTICLE_ATTRIBUTE_POSITION}));
  sets.push_back(MakeSet(3, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS,
                             v1::PARTICLE_ATTRIBUTE_OPACITY, v1::PARTICLE_ATTRIBUTE_COLOR}));
  sets.push_back(MakeSet(3, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS}));
  sets.push_back(MakeSet(0, {v1::PARTICLE_ATTRIBUTE_POSITION}));
  // Called what it is, but no set.
  NamedSet bad = MakeSet(4, {v1::PARTICLE_ATTRIBUTE_POSITION});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(bad.particles.mutable_payload()->data() + 36, &nan, sizeof(nan));
  bad.header = testing::Describe(bad.particles);
  bad.valid = false;
  sets.push_back(bad);
  return sets;
}

template <typename T>
bool Update(Sha256& digest, const std::vector<T>& values) {
  digest.Update({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
  return !values.empty();
}

// The name that a set of some particles should have.
std::string NameOf(const ParticleSet& set) {
  v1::ParticleLayout layout;
  layout.set_count(set.size());
  layout.mutable_origin()->set_x(set.origin.x);
  layout.mutable_origin()->set_y(set.origin.y);
  layout.mutable_origin()->set_z(set.origin.z);
  const bool has[] = {!set.positions.empty(), !set.radii.empty(),      !set.opacities.empty(),
                      !set.colors.empty(),    !set.velocities.empty(), !set.emissions.empty()};
  for (size_t i = 0; i < kAttributeFormats.size(); ++i) {
    if (has[i]) {
      layout.add_attributes(kAttributeFormats[i].attribute);
    }
  }
  Sha256 digest = BeginParticleDigest(layout);
  Update(digest, set.positions);
  Update(digest, set.radii);
  Update(digest, set.opacities);
  Update(digest, set.colors);
  Update(digest, set.velocities);
  Update(digest, set.emissions);
  return digest.Finish();
}

class Server {
 public:
  void Step(Input& input) {
    const auto client = input.Below(kClients);
    const NamedSet& set = sets_[input.Below(static_cast<uint8_t>(sets_.size()))];
    const auto step = input.Below(9);
    const auto first = step == 0 || step == 4 || step == 6 || step == 7 ? uint8_t{0} : input.Byte();
    switch (step) {
      case 0:
        streams_[client].emplace(store_, partial_, limits_, Caller{.peer = std::to_string(client)});
        at_[client] = 0;
        break;
      case 1:
        SendHeader(client, set, first, input.Byte());
        break;
      case 2:
        SendChunk(client, set, first, input.Byte());
        break;
      case 3:
        SendFinish(client, set, first);
        break;
      case 4:
        End(client);
        break;
      case 5:
        now_ += std::chrono::seconds(first);
        break;
      case 6:
        partial_.DropExpired();
        break;
      case 7:
        Require(partial_.CommittedBytes(set.header.sha256()) <= kMemoryBytes,
                "no more is kept than there is memory");
        break;
      case 8: {
        v1::UploadParticlesRequest message;
        const std::string_view bytes = input.Bytes(first);
        if (message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
          Send(client, message);
        }
        break;
      }
    }
    CheckFound();
  }

  void EndAll() {
    for (auto& stream : streams_) {
      stream.reset();
    }
    for (const NamedSet& set : sets_) {
      if (set.valid) {
        Resume(set);
        Require(Upload(set, 0).ok(), "an honest upload gets through");
        Require(store_.Find(set.header.sha256()) != nullptr, "what was uploaded is found");
      }
      CheckFound();
    }
    now_ += partial_age_;
    partial_.DropExpired();
    Require(memory_.left() == kMemoryBytes, "all memory for uploads is given back");
    Require(store_.bytes() <= kStoreBytes, "the store keeps to its bytes");
  }

 private:
  void SendHeader(size_t client, const NamedSet& set, uint8_t twist, uint8_t resume) {
    v1::ParticleSetDescription header = set.header;
    switch (twist % 8) {
      case 0:
        header.mutable_sha256()->back() ^= 1;
        break;
      case 1:
        header.set_byte_size(header.byte_size() + resume);
        break;
      case 2:
        header.mutable_layout()->set_count(resume);
        header.set_byte_size(PayloadBytes(header.layout()).value_or(0));
        break;
      case 3:
        header.mutable_layout()->mutable_origin()->set_x(resume);
        break;
      default:
        break;
    }
    // From where it left off, from where the server says, or from anywhere.
    const uint64_t kept = partial_.CommittedBytes(header.sha256());
    const uint64_t offset = twist < 64 ? 0 : twist < 128 ? kept : resume;
    at_[client] = offset;
    Send(client, testing::Header(header, offset));
  }

  void SendChunk(size_t client, const NamedSet& set, uint8_t size, uint8_t twist) {
    const std::string& payload = set.particles.payload();
    const size_t at = twist == 1 ? 0 : std::min<size_t>(at_[client], payload.size());
    std::string chunk = payload.substr(at, size);
    if (twist == 2) {
      chunk.resize(size);  // past the payload's end
    }
    if (twist == 3 && !chunk.empty()) {
      chunk.back() = static_cast<char>(chunk.back() ^ 1);
    }
    at_[client] += chunk.size();
    Send(client, testing::Chunk(chunk));
  }

  void SendFinish(size_t client, const NamedSet& set, uint8_t twist) {
    v1::UploadParticlesRequest message = testing::Finish(set.header);
    if (twist == 1) {
      message.mutable_finish()->set_byte_size(set.header.byte_size() + 1);
    }
    if (twist == 2) {
      message.mutable_finish()->mutable_sha256()->back() ^= 1;
    }
    Send(client, message);
  }

  void Send(size_t client, const v1::UploadParticlesRequest& message) {
    if (!streams_[client].has_value()) {
      return;
    }
    ParticleUpload& stream = *streams_[client];
    const bool answered = stream.response().has_value();
    if (message.has_header()) {
      headers_[client] = message.header();
    }
    if (!stream.Receive(message).ok()) {
      streams_[client].reset();
      return;
    }
    Require(!answered, "nothing is taken behind the answer");
    Require(!stream.response().has_value() || headers_[client].byte_size() > kStoreBytes ||
                store_.Find(headers_[client].sha256()) != nullptr,
            "an answer means that the set of that name is there");
    Require(partial_.memory().left() <= kMemoryBytes, "memory is not given back twice");
  }

  void End(size_t client) {
    if (streams_[client].has_value()) {
      const bool answered = streams_[client]->response().has_value();
      Require(streams_[client]->AtEndOfStream().ok() == answered, "OK comes with an answer alone");
      streams_[client].reset();
    }
  }

  // An honest client that goes on from what the server says it has. That may be somebody else's
  // rubbish; whether it is shows at the end.
  void Resume(const NamedSet& set) {
    const uint64_t kept = partial_.CommittedBytes(set.header.sha256());
    const absl::Status status = Upload(set, std::min<uint64_t>(kept, set.header.byte_size()));
    Require(status.ok() || absl::IsDataLoss(status) || absl::IsOutOfRange(status),
            "resumed uploads end as they should: " + status.ToString());
  }

  absl::Status Upload(const NamedSet& set, uint64_t offset) {
    ParticleUpload stream(store_, partial_, limits_);
    for (const auto& message :
         {testing::Header(set.header, offset),
          testing::Chunk(set.particles.payload().substr(offset)), testing::Finish(set.header)}) {
      if (absl::Status status = stream.Receive(message); !status.ok()) {
        return status;
      }
      if (stream.response().has_value()) {
        break;
      }
    }
    return stream.AtEndOfStream();
  }

  void CheckFound() {
    for (const NamedSet& set : sets_) {
      std::string name = set.header.sha256();
      if (const auto found = store_.Find(name)) {
        Require(set.valid, "no set has values that are not allowed");
        Require(found->size() == 0 || NameOf(*found) == name, "a set is what it is called");
      }
      name.back() = static_cast<char>(name.back() ^ 1);
      Require(store_.Find(name) == nullptr, "nothing has a name that is not its own");
    }
  }

  const std::vector<NamedSet> sets_ = MakeSets();
  const ServerLimits limits_{};
  const std::chrono::seconds partial_age_{100};
  PartialUploadOptions::Time now_{};
  ParticleStore store_{kStoreBytes};
  ByteBudget memory_{kMemoryBytes, kClientBytes};
  PartialUploads partial_{
      memory_, {.max_count = 2, .max_age = partial_age_, .now = [this] { return now_; }}};
  std::array<std::optional<ParticleUpload>, kClients> streams_;
  std::array<v1::ParticleSetDescription, kClients> headers_;
  std::array<uint64_t, kClients> at_{};  // where each believes to be
};

}  // namespace
}  // namespace halflight::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  halflight::fuzz::Input input(data, size);
  halflight::fuzz::Server server;
  for (int step = 0; step < halflight::fuzz::kMaxSteps && !input.empty(); ++step) {
    server.Step(input);
  }
  server.EndAll();
  return 0;
}
