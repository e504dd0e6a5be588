// The command line of halflightd: what is taken and how bad values are told.

#include "server/options.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/handlers/get_server_info.h"
#include "server/unix_socket.h"
#include "tests/process/process.h"
#include "tests/server/fake_engine.h"

namespace halflight {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

absl::StatusOr<std::optional<Options>> Parse(std::vector<const char*> arguments,
                                             std::ostringstream* out = nullptr) {
  std::ostringstream ignored;
  arguments.insert(arguments.begin(), "halflightd");
  return ParseOptions(static_cast<int>(arguments.size()), arguments.data(),
                      out != nullptr ? *out : ignored);
}

std::string ErrorOf(const std::vector<const char*>& arguments) {
  const auto options = Parse(arguments);
  EXPECT_EQ(options.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(options.status().message());
}

TEST(Options, WithoutFlagsAreComplete) {
  const auto options = Parse({});
  ASSERT_TRUE(options.ok() && options->has_value()) << options.status();
  EXPECT_THAT((*options)->addresses, ElementsAre());
  EXPECT_FALSE((*options)->access.insecure_listen);
  EXPECT_GE((*options)->encode_threads, 1);
}

TEST(Options, TakeSeveralAddressesAndSizesWithSuffixes) {
  const auto options =
      Parse({"--address", "0.0.0.0:0", "--address", "unix:/tmp/x", "--max-cache-bytes", "3GiB",
             "--max-particle-bytes", "64MiB", "--max-slices", "77", "--drain-seconds", "5",
             "--max-reuse-bytes", "0", "--frames-in-flight", "3"});
  ASSERT_TRUE(options.ok() && options->has_value()) << options.status();
  EXPECT_THAT((*options)->addresses, ElementsAre("0.0.0.0:0", "unix:/tmp/x"));
  EXPECT_EQ((*options)->limits.max_cache_bytes, 3 * kGiB);
  EXPECT_EQ((*options)->limits.max_particle_bytes, 64 * kMiB);
  EXPECT_EQ((*options)->limits.max_slices, 77U);
  EXPECT_EQ((*options)->drain_seconds, 5);
  EXPECT_EQ((*options)->max_reuse_bytes, 0U);
  EXPECT_EQ((*options)->frames_in_flight, 3);
}

TEST(Options, CacheDirectoryHasABoundAndWithoutOneThereIsNone) {
  EXPECT_EQ((*Parse({}))->limits.max_cache_dir_bytes, 0U);
  const auto options = Parse({"--cache-dir", "/var/cache/halflight", "--partial-upload-seconds",
                              "60", "--max-partial-uploads", "5"});
  ASSERT_TRUE(options.ok() && options->has_value()) << options.status();
  EXPECT_EQ((*options)->cache_dir, "/var/cache/halflight");
  EXPECT_EQ((*options)->limits.max_cache_dir_bytes, 16 * kGiB);
  EXPECT_EQ((*options)->limits.partial_upload_seconds, 60U);
  EXPECT_EQ((*options)->limits.max_partial_uploads, 5U);
}

TEST(Options, SharesOfAClientAreThreeQuartersAndEnoughForOneUnlessToldOtherwise) {
  const ServerLimits usual = (*Parse({}))->limits;
  EXPECT_EQ(usual.max_client_frame_bytes, 3 * kGiB);
  EXPECT_EQ(usual.max_client_set_bytes, 3 * kGiB);
  EXPECT_EQ(usual.max_client_upload_bytes, 3 * kGiB);
  EXPECT_EQ(usual.max_client_connections, 3072U);
  EXPECT_EQ((*Parse({"--max-connections", "1"}))->limits.max_client_connections, 1U);
  const ServerLimits small = (*Parse({"--max-frame-bytes", "2GiB", "--max-cache-bytes", "1100MiB",
                                      "--max-client-set-bytes", "1050MiB"}))
                                 ->limits;
  EXPECT_EQ(small.max_client_frame_bytes, 1536 * kMiB);
  EXPECT_EQ(small.max_client_set_bytes, 1050 * kMiB);
  EXPECT_EQ(small.max_client_upload_bytes, 1 * kGiB) << "a set of --max-particle-bytes";
}

// What a server started with these limits tells of them.
v1::ServerLimits Told(const ServerLimits& limits) {
  testing::FakeEngine engine;
  const std::string version = "1";
  ParticleStore store(1);
  ByteBudget memory(1);
  PartialUploads partial_uploads(memory, {});
  FramePipeline pipeline(engine, {});
  return GetServerInfo({engine.device(), limits, version, store, partial_uploads, pipeline})
      .limits();
}

// Each limit is a flag, a line of the configuration and a field of one name: set to a value of its
// own, it is told as that.
TEST(Options, EachLimitIsToldAsItWasSet) {
  // Of those that are held against others, or that have a range of their own.
  std::map<std::string, uint64_t> values = {{"max_message_bytes", 200000},
                                            {"max_cache_bytes", 5000},
                                            {"max_cache_dir_bytes", 6000},
                                            {"max_lights", 7}};
  const google::protobuf::Descriptor& all = *v1::ServerLimits::descriptor();
  const testing::Folder folder;
  // Without the directory its bytes are told as 0.
  std::vector<std::string> words = {"--cache-dir", folder / "cache"};
  std::string lines = "cache-dir = " + folder / "cache" + "\n";
  for (int i = 0; i < all.field_count(); ++i) {
    std::string name = all.field(i)->name();
    const std::string value = std::to_string(values.try_emplace(name, 70 + i).first->second);
    std::replace(name.begin(), name.end(), '_', '-');
    words.insert(words.end(), {"--" + name, value});
    lines += name + " = " + value + "\n";
  }
  std::vector<const char*> flags;
  std::transform(words.begin(), words.end(), std::back_inserter(flags),
                 [](const std::string& word) { return word.c_str(); });
  const std::string path = folder.Write("halflightd.conf", lines);
  for (const auto& options : {Parse(flags), Parse({"--config", path.c_str()})}) {
    ASSERT_TRUE(options.ok()) << options.status();
    const v1::ServerLimits told = Told((*options)->limits);
    const google::protobuf::Reflection& fields = *told.GetReflection();
    for (int i = 0; i < all.field_count(); ++i) {
      const google::protobuf::FieldDescriptor& field = *all.field(i);
      const bool narrow = field.cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_UINT32;
      EXPECT_EQ(narrow ? fields.GetUInt32(told, &field) : fields.GetUInt64(told, &field),
                values[field.name()])
          << field.name();
    }
  }
}

// And the other way round: no limit but these two, which change how long frames take and not what
// is accepted, is kept from clients.
TEST(Options, EachFlagOfALimitIsAFieldOfThem) {
  std::ostringstream out;
  ASSERT_TRUE(Parse({"--help"}, &out).ok());
  const std::string help = out.str();
  const size_t begin = help.find("\nLimits:");
  ASSERT_NE(begin, std::string::npos);
  std::istringstream limits(help.substr(begin + 9, help.find("\n\n", begin + 9) - begin - 9));
  int flags = 0;
  for (std::string line; std::getline(limits, line);) {
    if (line.rfind("  --", 0) == 0) {
      std::string name = line.substr(4, line.find(' ', 4) - 4);
      std::replace(name.begin(), name.end(), '-', '_');
      const bool told = v1::ServerLimits::descriptor()->FindFieldByName(name) != nullptr;
      EXPECT_NE(told, name == "max_reuse_bytes" || name == "frames_in_flight") << name;
      ++flags;
    }
  }
  EXPECT_EQ(flags, v1::ServerLimits::descriptor()->field_count() + 2);
}

TEST(Options, HelpNamesEveryFlagAndRunsNothing) {
  std::ostringstream out;
  const auto options = Parse({"--help"}, &out);
  ASSERT_TRUE(options.ok());
  EXPECT_FALSE(options->has_value());
  for (const char* flag : {"--address",
                           "--device",
                           "--log-level",
                           "--encode-threads",
                           "--watchdog-seconds",
                           "--channelz",
                           "--log-format",
                           "--insecure-metrics",
                           "--metrics-address",
                           "--drain-seconds",
                           "--version",
                           "--max-particles",
                           "--max-particle-bytes",
                           "--max-cache-bytes",
                           "--max-image-size",
                           "--max-reuse-bytes",
                           "--max-reference-work",
                           "--max-light-buffer-size",
                           "--max-slices",
                           "--max-lights",
                           "--frames-in-flight",
                           "--max-outputs",
                           "--max-output-bytes",
                           "--max-queued-frames",
                           "--max-message-bytes",
                           "--cache-dir",
                           "--max-cache-dir-bytes",
                           "--max-partial-uploads",
                           "--partial-upload-seconds",
                           "--max-client-frames",
                           "--max-frame-bytes",
                           "--max-client-frame-bytes",
                           "--max-client-upload-bytes",
                           "--max-client-set-bytes",
                           "--max-frame-seconds",
                           "--max-stall-seconds",
                           "--min-bytes-per-second",
                           "--max-calls",
                           "--max-client-calls",
                           "--max-connections",
                           "--max-client-connections",
                           "--max-connection-streams",
                           "--max-handshake-seconds",
                           "--max-idle-seconds",
                           "--tls-cert",
                           "--tls-key",
                           "--tls-client-ca",
                           "--token-file",
                           "--insecure-listen",
                           "--config"}) {
    EXPECT_THAT(out.str(), HasSubstr(flag));
  }
}

TEST(Options, ErrorsNameFlagValueAndWhatIsAllowed) {
  EXPECT_THAT(ErrorOf({"--address", "nonsense"}), HasSubstr("--address: nonsense, allowed: "));
  EXPECT_THAT(ErrorOf({"--address", "host:70000"}), HasSubstr("--address: host:70000"));
  EXPECT_THAT(ErrorOf({"--address", "unix:"}), HasSubstr("--address: unix:"));
  EXPECT_THAT(ErrorOf({"--address", "a:1", "--address", "a:1"}), HasSubstr("a:1 twice"));
  EXPECT_THAT(ErrorOf({"--log-level", "loud"}),
              HasSubstr("--log-level: loud, allowed: trace, debug"));
  EXPECT_THAT(ErrorOf({"--max-image-size", "0"}), HasSubstr("--max-image-size: 0, allowed: [1,"));
  EXPECT_THAT(ErrorOf({"--max-message-bytes", "1000"}), HasSubstr("--max-message-bytes: 1000"));
  for (const char* wrong : {"-3", "010", "1e3", ""}) {
    EXPECT_THAT(ErrorOf({"--max-queued-frames", wrong}),
                HasSubstr("--max-queued-frames: " + std::string(wrong) + ", allowed: "));
    EXPECT_THAT(ErrorOf({"--max-reference-work", wrong}), HasSubstr("--max-reference-work: "));
    EXPECT_THAT(ErrorOf({"--drain-seconds", wrong}), HasSubstr("--drain-seconds: "));
  }
  EXPECT_THAT(ErrorOf({"--max-reference-work", "18446744073709551616"}), HasSubstr("allowed: "));
  EXPECT_THAT(ErrorOf({"--max-cache-bytes", "010MiB"}), HasSubstr("--max-cache-bytes: 010MiB"));
  EXPECT_THAT(ErrorOf({"--max-cache-bytes", "1MiB", "--max-particle-bytes", "2MiB"}),
              HasSubstr("--max-cache-bytes: 1048576, allowed: at least --max-particle-bytes"));
  EXPECT_THAT(
      ErrorOf({"--max-client-upload-bytes", "1MiB", "--max-particle-bytes", "2MiB"}),
      HasSubstr("--max-client-upload-bytes: 1048576, allowed: at least --max-particle-bytes"));
  EXPECT_THAT(ErrorOf({"--max-client-frame-bytes", "1MiB"}),
              HasSubstr("--max-client-frame-bytes: 1048576, allowed: at least --max-output-bytes"));
  EXPECT_THAT(ErrorOf({"--max-cache-bytes", "-1"}), HasSubstr("--max-cache-bytes: -1, allowed: "));
  EXPECT_THAT(ErrorOf({"--cache-dir", "/c", "--max-cache-dir-bytes", "1MiB"}),
              HasSubstr("--max-cache-dir-bytes: 1048576, allowed: at least --max-particle-bytes"));
  EXPECT_THAT(ErrorOf({"--max-cache-dir-bytes", "20GiB"}), HasSubstr("--cache-dir"));
  EXPECT_THAT(ErrorOf({"--max-partial-uploads", "65537"}),
              HasSubstr("--max-partial-uploads: 65537, allowed: [0, 65536]"));
  EXPECT_THAT(ErrorOf({"--partial-upload-seconds", "-1"}), HasSubstr("--partial-upload-seconds"));
  EXPECT_THAT(ErrorOf({"--drain-seconds", "-1"}), HasSubstr("--drain-seconds"));
  EXPECT_THAT(ErrorOf({"--watchdog-seconds", "-1"}), HasSubstr("--watchdog-seconds"));
  EXPECT_THAT(ErrorOf({"--plan-device-faults", "flood:1"}), HasSubstr("\"flood:1\", allowed: "));
  EXPECT_THAT(ErrorOf({"--frames-in-flight", "17"}),
              HasSubstr("--frames-in-flight: 17, allowed: [0, 16]"));
  EXPECT_THAT(ErrorOf({"--no-such-flag"}), HasSubstr("--no-such-flag"));
  EXPECT_THAT(ErrorOf({"stray"}), HasSubstr("stray"));
}

TEST(Options, CertificateAndKeyComeTogether) {
  EXPECT_THAT(ErrorOf({"--tls-cert", "a.pem"}), HasSubstr("--tls-key: "));
  EXPECT_THAT(ErrorOf({"--tls-key", "a.pem"}), HasSubstr("--tls-cert: "));
  EXPECT_THAT(ErrorOf({"--tls-client-ca", "a.pem"}),
              HasSubstr("--tls-client-ca: a.pem, allowed: "));
  EXPECT_THAT(ErrorOf({"--token-file", ""}), HasSubstr("--token-file: \"\", allowed: "));
  EXPECT_THAT(ErrorOf({"--max-connections", "0"}), HasSubstr("--max-connections: 0, allowed: [1,"));
  EXPECT_THAT(ErrorOf({"--max-idle-seconds", "0"}), HasSubstr("--max-idle-seconds: 0"));
}

class ConfigFile : public ::testing::Test {
 protected:
  [[nodiscard]] std::string Write(const std::string& text) const {
    return folder_.Write("halflightd.conf", text);
  }
  const testing::Folder folder_;
};

TEST_F(ConfigFile, SaysAllThatFlagsSayALineEach) {
  const std::string path = Write(
      "# the render node\n"
      "address = [\"127.0.0.1:1\", \"unix:/run/h/socket\"]\n"
      "max-cache-bytes = 3GiB\n"
      "max-slices=77\n"
      "\n"
      "insecure-listen = true\n"
      "tls-cert = \"a b.pem\"\n"
      "tls-key = k.pem\n");
  const auto options = Parse({"--config", path.c_str()});
  ASSERT_TRUE(options.ok() && options->has_value()) << options.status();
  EXPECT_THAT((*options)->addresses, ElementsAre("127.0.0.1:1", "unix:/run/h/socket"));
  EXPECT_EQ((*options)->limits.max_cache_bytes, 3 * kGiB);
  EXPECT_EQ((*options)->limits.max_slices, 77U);
  EXPECT_TRUE((*options)->access.insecure_listen);
  EXPECT_EQ((*options)->access.tls.certificate, "a b.pem");
  EXPECT_EQ((*options)->access.tls.key, "k.pem");
}

// What is to be started from, with its suggestions taken up.
TEST_F(ConfigFile, OfTheDeploymentIsRight) {
  std::ifstream shipped(HALFLIGHT_DEPLOY "/halflightd.conf");
  std::string taken_up;
  for (std::string line; std::getline(shipped, line);) {
    const bool suggestion = line.rfind('#', 0) == 0 && line.find(" = ") != std::string::npos;
    taken_up += line.substr(suggestion ? 1 : 0) + "\n";
  }
  const std::string path = Write(taken_up);
  const auto options = Parse({"--config", path.c_str()});
  ASSERT_TRUE(options.ok() && options->has_value()) << options.status();
  EXPECT_EQ((*options)->metrics.address, "127.0.0.1:9464");
  EXPECT_EQ((*options)->access.token_file, "/etc/halflight/tokens");
}

TEST_F(ConfigFile, GivesWayToFlags) {
  const std::string path =
      Write("address = [\"127.0.0.1:1\", \"127.0.0.1:2\"]\nmax-slices = 77\nmax-lights = 3\n");
  const auto options =
      Parse({"--max-slices", "5", "--config", path.c_str(), "--address", "127.0.0.1:3"});
  ASSERT_TRUE(options.ok() && options->has_value()) << options.status();
  EXPECT_THAT((*options)->addresses, ElementsAre("127.0.0.1:3"));
  EXPECT_EQ((*options)->limits.max_slices, 5U);
  EXPECT_EQ((*options)->limits.max_lights, 3U);
}

TEST_F(ConfigFile, ErrorsNameFileAndKey) {
  const auto error = [this](const std::string& text) {
    return ErrorOf({"--config", Write(text).c_str()});
  };
  const std::string path = folder_ / "halflightd.conf";
  EXPECT_THAT(error("max-slices = 5\nmax-slizes = 5\n"), HasSubstr(path + ": max-slizes: is no"));
  EXPECT_THAT(error("[part]\nmax-slices = 5\n"), HasSubstr(path + ": part."));
  EXPECT_THAT(error("max-slices = many\n"), HasSubstr("max-slices"));
  EXPECT_THAT(error("max-slices = many\n"), HasSubstr(path));
  EXPECT_THAT(error("max-slices = 0\n"), HasSubstr("--max-slices: 0, allowed"));
  EXPECT_THAT(ErrorOf({"--config", "/no/such/file"}), HasSubstr("/no/such/file"));
}

TEST(LimitsOnDevice, HoldLightBuffersToTexturesAndImagesToNone) {
  DeviceInfo device;
  device.max_texture_size = 2048;
  const ServerLimits limits = LimitsOnDevice({}, device);
  EXPECT_EQ(limits.max_image_size, ServerLimits{}.max_image_size);
  EXPECT_EQ(limits.max_light_buffer_size, 2048U);
}

}  // namespace
}  // namespace halflight
