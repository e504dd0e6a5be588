// Messages that are none, of each RPC: an error each time, and nothing left of them.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "halflight/v1/service.grpc.pb.h"
#include "tests/access/health.h"
#include "tests/server/upload_messages.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

using testing::Chunk;
using testing::Finish;
using testing::Header;

constexpr std::chrono::seconds kPatience(20);

// Messages of one call, which must not end with OK.
struct Bad {
  std::string name;
  std::string method;
  std::vector<std::string> messages;
};

std::string Bytes(const google::protobuf::Message& message) { return message.SerializeAsString(); }

struct Set {
  v1::ParticleSetDescription description;
  std::string payload;
};

Set SetOf(size_t particles, uint32_t seed) {
  const client::EncodedParticles encoded = BallOf(particles, seed);
  Set set;
  *set.description.mutable_layout() = encoded.layout;
  set.description.set_byte_size(encoded.payload.size());
  set.description.set_sha256(encoded.sha256);
  set.payload = encoded.payload;
  return set;
}

std::vector<Bad> BadUploads(const Set& set) {
  const std::string header = Bytes(Header(set.description));
  const std::string half = Bytes(Chunk(set.payload.substr(0, set.payload.size() / 2)));
  const std::string rest = Bytes(Chunk(set.payload.substr(set.payload.size() / 2)));
  const std::string finish = Bytes(Finish(set.description));
  const std::string too_large(size_t{3} << 20U, '\x12');
  v1::ParticleSetDescription other = set.description;
  other.mutable_sha256()->back() ^= 1;
  v1::ParticleSetDescription larger = set.description;
  larger.set_byte_size(set.payload.size() + 4);
  std::string flipped = set.payload;
  flipped[flipped.size() / 3] ^= 1;
  const std::string method = "UploadParticles";
  std::vector<Bad> bad = {
      {"nothing", method, {}},
      {"an empty message", method, {""}},
      {"a chunk first", method, {half, rest, finish}},
      {"a finish first", method, {finish}},
      {"two headers", method, {header, header, half, rest, finish}},
      {"no finish", method, {header, half, rest}},
      {"half of it", method, {header, half, finish}},
      {"the halves in the wrong order", method, {header, rest, half, finish}},
      {"one half twice", method, {header, half, half, finish}},
      {"more than was said", method, {header, half, rest, rest, finish}},
      {"a chunk behind the finish", method, {header, half, rest, finish, rest}},
      {"two finishes", method, {header, half, rest, finish, finish}},
      {"a finish of another set", method, {header, half, rest, Bytes(Finish(other))}},
      {"another set's name", method, {Bytes(Header(other)), half, rest, Bytes(Finish(other))}},
      {"another size", method, {Bytes(Header(larger)), half, rest, Bytes(Finish(larger))}},
      {"a flipped bit", method, {header, Bytes(Chunk(flipped)), finish}},
      {"an offset beyond what is there",
       method,
       {Bytes(Header(set.description, 1000)), rest, finish}},
      {"a message too large", method, {header, too_large, finish}},
      {"garbage in between", method, {header, half, "\xff\xff\xff\xff\xff", rest, finish}},
      {"garbage at the end", method, {header, half, rest, "\xff\xff\xff\xff\xff"}}};
  // Each message cut short, at several places.
  for (const size_t part : {3U, 5U, 7U}) {
    bad.push_back({"a header cut short",
                   method,
                   {header.substr(0, header.size() * part / 8), half, rest, finish}});
    bad.push_back({"a chunk cut short",
                   method,
                   {header, half.substr(0, half.size() * part / 8), rest, finish}});
    bad.push_back({"a finish cut short",
                   method,
                   {header, half, rest, finish.substr(0, finish.size() * part / 8)}});
  }
  return bad;
}

std::vector<Bad> BadQuestions(const std::string& sha256) {
  std::vector<Bad> bad;
  v1::RenderFrameRequest good = FrameOf(sha256, 32);
  v1::RenderFrameRequest nan = good;
  nan.mutable_scene()->mutable_material()->set_opacity(std::nanf(""));
  v1::RenderFrameRequest short_name = good;
  short_name.mutable_scene()->set_particle_sha256(sha256.substr(1));
  v1::RenderFrameRequest huge = good;
  huge.mutable_scene()->mutable_camera()->set_width(1U << 31U);
  const std::string too_large(size_t{3} << 20U, '\x12');
  const std::vector<std::pair<std::string, std::string>> frames = {
      {"an empty message", ""},
      {"garbage", "\xff\xff\xff\xff\xff"},
      {"cut short", Bytes(good).substr(0, Bytes(good).size() - 3)},
      {"a message too large", too_large},
      {"not a number", Bytes(nan)},
      {"a name too short", Bytes(short_name)},
      {"an image too large", Bytes(huge)}};
  for (const auto& [name, bytes] : frames) {
    bad.push_back({name, kRenderFrame, {bytes}});
    // A sequence's request is the frame's in its field 1.
    v1::RenderSequenceRequest sequence;
    *sequence.mutable_frame() = good;
    std::string wrapped = bytes;
    v1::RenderFrameRequest parsed;
    if (parsed.ParseFromString(bytes)) {
      v1::RenderSequenceRequest wrong;
      *wrong.mutable_frame() = parsed;
      wrapped = Bytes(wrong);
    }
    bad.push_back({name + ", first of a sequence", "RenderSequence", {wrapped}});
    if (!bytes.empty()) {  // which asks for the same frame again
      bad.push_back(
          {name + ", second of a sequence", "RenderSequence", {Bytes(sequence), wrapped}});
    }
  }
  bad.push_back({"nothing", kRenderFrame, {}});
  for (const char* method : {"QueryUpload", "FindMissingParticles", "GetServerInfo"}) {
    bad.push_back({"garbage", method, {"\xff\xff\xff\xff\xff"}});
    bad.push_back({"a message too large", method, {too_large}});
    bad.push_back({"nothing", method, {}});
  }
  v1::FindMissingParticlesRequest names;
  for (int i = 0; i < 2000; ++i) {
    names.add_sha256(sha256);
  }
  bad.push_back({"too many names", "FindMissingParticles", {Bytes(names)}});
  v1::QueryUploadRequest query;
  query.set_sha256("short");
  bad.push_back({"a name too short", "QueryUpload", {Bytes(query)}});
  bad.push_back({"no such method", "RenderNothing", {""}});
  return bad;
}

// A good upload's messages with something done to them at random: what comes of it may be OK only
// where the set of that name is then here, which its digest says.
std::vector<std::string> Mutated(const Set& set, std::mt19937& random) {
  std::vector<std::string> messages = {Bytes(Header(set.description))};
  for (size_t at = 0; at < set.payload.size(); at += 10000) {
    messages.push_back(Bytes(Chunk(set.payload.substr(at, 10000))));
  }
  messages.push_back(Bytes(Finish(set.description)));
  for (size_t times = 1 + random() % 3; times > 0; --times) {
    std::string& message = messages[random() % messages.size()];
    switch (random() % 5) {
      case 0:
        message.resize(random() % (message.size() + 1));
        break;
      case 1:
        message[random() % std::max<size_t>(1, message.size())] ^=
            static_cast<char>(1U << (random() % 8));
        break;
      case 2:
        std::swap(message, messages[random() % messages.size()]);
        break;
      case 3:
        messages.insert(messages.begin() + static_cast<long>(random() % messages.size()), message);
        break;
      default:
        messages.erase(messages.begin() + static_cast<long>(random() % messages.size()));
        if (messages.empty()) {
          messages.emplace_back();
        }
    }
  }
  return messages;
}

std::shared_ptr<Call> Send(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                           const std::vector<std::string>& messages,
                           std::chrono::seconds patience = kPatience) {
  CallOptions options{.method = method, .deadline = patience};
  for (const std::string& message : messages) {
    options.messages.push_back(soak::Bytes(message));
  }
  auto call = Call::Start(channel, std::move(options));
  call->Wait();
  return call;
}

bool IsHere(const std::shared_ptr<grpc::Channel>& channel, const std::string& sha256) {
  v1::QueryUploadRequest query;
  query.set_sha256(sha256);
  const auto call = Send(channel, "QueryUpload", {Bytes(query)});
  v1::QueryUploadResponse response;
  grpc::ByteBuffer answer = call->last();
  return call->status().ok() &&
         grpc::SerializationTraits<v1::QueryUploadResponse>::Deserialize(&answer, &response).ok() &&
         response.complete();
}

}  // namespace

void RunMalformed(Run& run) {
  const testing::Folder folder;
  // Little room, so that what is kept of uploads on purpose is soon all that may be.
  const Server server(folder, {"--max-particle-bytes", "1MiB", "--max-cache-bytes", "2MiB"},
                      run.sabotage ? "soak_bad_server" : "halflightd");
  const auto channel = testing::NewChannel(server.address());
  const client::EncodedParticles known = BallOf(500, 99);
  if (!run.sabotage) {
    Upload(server.address(), known);
  }
  const std::vector<Bad> questions = BadQuestions(known.sha256);
  const auto patience = run.sabotage ? std::chrono::seconds(1) : kPatience;
  std::mt19937 random(6);
  size_t calls = 0;
  size_t wrongly_ok = 0;
  size_t late = 0;
  double before = server.Megabytes();
  // The first rounds fill what is kept of uploads.
  const int rounds = run.sabotage ? 1 : run.Of(50, 2);
  for (int round = 0; round < rounds; ++round) {
    if (round == std::max(1, rounds / 5)) {
      if (!run.short_form) {
        server.Rest();
      }
      before = server.Megabytes();
    }
    std::vector<Bad> bad = questions;
    // A set of its own for each: one that is there already is answered with OK at once.
    const size_t uploads = BadUploads(SetOf(1, 1)).size();
    for (size_t i = 0; i < uploads; ++i) {
      bad.push_back(BadUploads(SetOf(3000, 1000 * static_cast<uint32_t>(round) + i))[i]);
    }
    for (const Bad& one : bad) {
      const auto call = Send(channel, one.method, one.messages, patience);
      ++calls;
      if (call->status().ok()) {
        if (++wrongly_ok < 10) {
          run.report.Tell("OK said to", one.method + ": " + one.name);
        }
      }
      late += call->status().error_code() == grpc::StatusCode::DEADLINE_EXCEEDED ? 1 : 0;
    }
    for (int i = 0; i < run.Of(100, 30); ++i) {
      const Set set = SetOf(4000, 1000 + random());
      const auto call = Send(channel, "UploadParticles", Mutated(set, random));
      ++calls;
      late += call->status().error_code() == grpc::StatusCode::DEADLINE_EXCEEDED ? 1 : 0;
      // Changes that undo each other, or that an upload may have, are no harm.
      wrongly_ok += call->status().ok() && !IsHere(channel, set.description.sha256()) ? 1 : 0;
    }
  }
  run.report.AtLeast("calls", static_cast<double>(calls), 80, "");
  run.report.None("ended with OK", wrongly_ok);
  run.report.None("not answered within 20 s", late);
  if (!run.short_form) {
    server.Rest();
  }
  run.report.MemoryAtMost("memory more", server.Megabytes() - before, run.Of(4, 40));
  run.report.Holds("serves afterwards", server.Serves());
  if (!run.sabotage) {
    MustRender(channel, FrameOf(known.sha256, 32));
  }
}

}  // namespace halflight::soak
