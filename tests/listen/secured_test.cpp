// Both programs, secured: what has to be said to get in, whose frames the log says they are, and
// that no token is told to anybody.

#include <csignal>
#include <string>
#include <tuple>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "halflight/sha256.h"
#include "tests/access/certificates.h"
#include "tests/listen/daemon.h"

namespace halflight {
namespace {

using testing::Authority;
using testing::Daemon;
using testing::Ended;
using testing::Folder;
using ::testing::HasSubstr;
using testing::Issued;
using testing::MakeRequest;
using ::testing::Not;
using testing::RunHalflight;
using testing::WaitFor;

constexpr const char* kToken = "open-sesame-0123";

class Secured : public ::testing::Test {
 protected:
  [[nodiscard]] std::vector<std::string> Flags() const {
    const Issued server = authority_.IssueServer();
    return {"--tls-cert",   folder_.Write("server.pem", server.certificate),
            "--tls-key",    folder_.Write("server.key", server.key),
            "--token-file", folder_.Write("tokens", ToHex(Sha256Of(kToken)) + " alice\n")};
  }

  const Folder folder_;
  const Authority authority_;
  const std::string ca_ = folder_.Write("ca.pem", authority_.certificate());
};

TEST_F(Secured, CommandLineGetsInWithItsToken) {
  const Daemon server(folder_, Flags());
  const std::string token = folder_.Write("token", std::string(kToken) + "\n");
  const std::vector<std::string> info = {"info", "--server", server.Address(), "--tls-ca", ca_};
  const auto with = [&](std::vector<std::string> words, const std::string& flag,
                        const std::string& value) {
    words.insert(words.end(), {flag, value});
    return words;
  };
  const Ended by_file = RunHalflight(folder_, with(info, "--token-file", token));
  EXPECT_EQ(by_file.code, 0) << by_file.err;
  EXPECT_THAT(by_file.out, HasSubstr("renderer: fake"));
  const Ended by_variable =
      RunHalflight(folder_, info, {.environment = {"HALFLIGHT_TOKEN=" + std::string(kToken)}});
  EXPECT_EQ(by_variable.code, 0) << by_variable.err;

  const Ended without = RunHalflight(folder_, info);
  EXPECT_EQ(without.code, 4);
  EXPECT_THAT(without.err, HasSubstr("authorization: is missing"));
  const Ended wrong =
      RunHalflight(folder_, with(info, "--token-file", folder_.Write("wrong", "open-sesame-9999")));
  EXPECT_EQ(wrong.code, 4);
  const Ended missing = RunHalflight(folder_, with(info, "--token-file", folder_ / "none"));
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.err, HasSubstr("token-file: '" + folder_ / "none"));
  const Ended plain =
      RunHalflight(folder_, {"info", "--server", server.Address(), "--timeout", "2"});
  EXPECT_EQ(plain.code, 5);
  for (const Ended& ended : {by_file, by_variable, without, wrong, missing, plain}) {
    EXPECT_THAT(ended.out + ended.err, Not(HasSubstr("open-sesame")));
  }
  EXPECT_THAT(server.Err(), Not(HasSubstr("open-sesame")));
}

TEST_F(Secured, CommandLineKeepsTokensFromOtherMachines) {
  const Ended ended =
      RunHalflight(folder_, {"info", "--server", "render.invalid:1", "--timeout", "2"},
                   {.environment = {"HALFLIGHT_TOKEN=" + std::string(kToken)}});
  EXPECT_EQ(ended.code, 2);
  EXPECT_THAT(ended.err, HasSubstr("plain text"));
  EXPECT_THAT(ended.err, Not(HasSubstr(kToken)));
}

TEST_F(Secured, LogSaysWhoseFramesTheyAre) {
  const Authority clients;
  std::vector<std::string> flags = Flags();
  flags.insert(flags.end(), {"--tls-client-ca", folder_.Write("c.pem", clients.certificate())});
  const Daemon server(folder_, flags);
  const auto render = [&](client::Security security, const std::string& id) {
    client::ClientOptions options;
    options.security = std::move(security);
    options.security.ca_file = ca_;
    auto client = client::Client::Connect(server.Address(), options);
    ASSERT_TRUE(client.ok()) << client.status();
    v1::RenderFrameRequest request = MakeRequest();
    request.set_request_id(id);
    const absl::Status status = client->RenderFrame(request).status();
    EXPECT_TRUE(status.ok()) << status;
  };
  const auto show = [&](const testing::Subject& subject) {
    const Issued issued = clients.Issue(subject);
    return client::Security{.cert_file = folder_.Write("client.pem", issued.certificate),
                            .key_file = folder_.Write("client.key", issued.key)};
  };
  render({.token = kToken}, "by-token");
  render(show({.common_name = "bob"}), "by-name");
  render(show({.common_name = "bob", .alternate = {"DNS:bob.example", "DNS:other.example"}}),
         "by-dns");
  render(show({.common_name = "bob", .alternate = {"DNS:bob.example", "URI:spiffe://example/bob"}}),
         "by-uri");
  for (const auto& [id, tenant] :
       {std::pair("by-token", "alice"), std::pair("by-name", "bob"),
        std::pair("by-dns", "bob.example"), std::pair("by-uri", "spiffe://example/bob")}) {
    EXPECT_TRUE(WaitFor([&, id = id, tenant = tenant] {
      return server.Logged(
          fmt::format("frame request_id={} tenant={} peer=ipv4:127.0.0.1:", id, tenant));
    })) << server.Err();
  }
}

TEST_F(Secured, LogSaysWhatWasReadAgain) {
  const Daemon server(folder_, Flags());
  ASSERT_NE(server.Address(), "");
  const std::string tokens = folder_.Write("tokens", "damaged\n");
  EXPECT_TRUE(WaitFor([&] { return server.Logged(tokens + ": line 1"); })) << server.Err();
  EXPECT_TRUE(server.Logged("not_reloaded"));
  // Who takes a line out of it is to hear that it is still wrong.
  const auto complaints = [&] {
    const std::string log = server.Err();
    int count = 0;
    for (size_t at = 0; (at = log.find(tokens + ": line 1", at)) != std::string::npos; ++at) {
      ++count;
    }
    return count;
  };
  EXPECT_EQ(complaints(), 1);
  std::ignore = folder_.Write("tokens", "damaged again\n");
  EXPECT_TRUE(WaitFor([&] { return complaints() == 2; })) << server.Err();
  [[maybe_unused]] const auto good = folder_.Write("tokens", ToHex(Sha256Of("another")) + " bob\n");
  EXPECT_TRUE(WaitFor([&] { return server.Logged(" reloaded files=" + tokens); }));
}

TEST_F(Secured, ConfigFileSaysAllThatFlagsCan) {
  const std::vector<std::string> flags = Flags();
  std::string config;
  for (size_t i = 0; i < flags.size(); i += 2) {
    config += flags[i].substr(2) + " = \"" + flags[i + 1] + "\"\n";
  }
  const Daemon server(folder_, {"--config", folder_.Write("halflightd.conf", config)});
  EXPECT_EQ(RunHalflight(folder_, {"info", "--server", server.Address(), "--tls-ca", ca_}).code, 4);
}

}  // namespace
}  // namespace halflight
