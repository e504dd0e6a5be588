// Certificates and keys that fit together, and those that do not.

#include "server/access/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/access/certificates.h"
#include "tests/process/process.h"

namespace halflight {
namespace {

using testing::Authority;
using testing::Folder;
using ::testing::HasSubstr;
using testing::Issued;

class TlsFilesTest : public ::testing::Test {
 protected:
  TlsPaths Write(const std::string& certificate, const std::string& key,
                 const std::string& authorities = "") {
    return {folder_.Write("cert.pem", certificate), folder_.Write("key.pem", key),
            authorities.empty() ? "" : folder_.Write("ca.pem", authorities)};
  }

  static std::string ErrorOf(const TlsPaths& paths) {
    const auto files = LoadTlsFiles(paths);
    EXPECT_EQ(files.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(files.status().message());
  }

  const Folder folder_;
  const Authority authority_;
  const Issued server_ = authority_.IssueServer();
};

TEST_F(TlsFilesTest, AreTakenWhereTheyFitTogether) {
  const auto files = LoadTlsFiles(Write(server_.certificate + authority_.certificate(), server_.key,
                                        authority_.certificate() + Authority().certificate()));
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_EQ(files->key, server_.key);
  EXPECT_TRUE(LoadTlsFiles(Write(server_.certificate, server_.key)).ok());
}

TEST_F(TlsFilesTest, ErrorsNameTheFile) {
  EXPECT_THAT(ErrorOf({folder_ / "none.pem", folder_ / "none.pem", ""}),
              HasSubstr(folder_ / "none.pem: No such file"));
  EXPECT_THAT(ErrorOf({folder_.path(), folder_.path(), ""}), HasSubstr(folder_.path()));
  EXPECT_THAT(ErrorOf(Write("garbage", server_.key)), HasSubstr("cert.pem: holds no certificate"));
  EXPECT_THAT(ErrorOf(Write(server_.certificate, "garbage")), HasSubstr("key.pem: holds no"));
  EXPECT_THAT(ErrorOf(Write(server_.certificate, authority_.IssueServer().key)),
              HasSubstr("key.pem: is not the key of the certificate in"));
  EXPECT_THAT(ErrorOf(Write(server_.certificate, server_.key, "garbage")),
              HasSubstr("ca.pem: holds no certificate"));
  EXPECT_THAT(ErrorOf(Write(std::string(2 << 20, 'x'), server_.key)), HasSubstr("too large"));
}

// gRPC would find out with the first client.
TEST_F(TlsFilesTest, ThoseThatTlsDoesNotTakeAreRefused) {
  const Issued weak = authority_.Issue({.common_name = "a", .weak = true});
  EXPECT_THAT(ErrorOf(Write(weak.certificate, weak.key)),
              HasSubstr("cert.pem: a certificate that TLS does not take: "));
  EXPECT_THAT(ErrorOf(Write(server_.certificate + weak.certificate, server_.key)),
              HasSubstr("cert.pem: a certificate that TLS does not take: "));
}

TEST_F(TlsFilesTest, HalfWrittenOnesAreRefused) {
  const std::string chain = server_.certificate + authority_.certificate();
  // Without its last line a certificate is none; the first one alone is one, with or without the
  // end of that line.
  const size_t whole = server_.certificate.size();
  for (size_t size = 0; size + 30 < chain.size(); ++size) {
    if (size + 2 < whole && size % 50 != 0) continue;
    const std::string part = chain.substr(0, size);
    EXPECT_EQ(LoadTlsFiles(Write(part, server_.key)).ok(), size + 1 == whole || size == whole)
        << part;
  }
}

TEST_F(TlsFilesTest, HoldForTheTimeTheyAreMadeFor) {
  const Issued past =
      authority_.Issue({.common_name = "a", .valid_from_seconds = -20, .valid_until_seconds = -10});
  EXPECT_THAT(ErrorOf(Write(past.certificate, past.key)), HasSubstr("has expired"));
  const Issued future =
      authority_.Issue({.common_name = "a", .valid_from_seconds = 60, .valid_until_seconds = 90});
  EXPECT_THAT(ErrorOf(Write(future.certificate, future.key)), HasSubstr("not valid yet"));
}

}  // namespace
}  // namespace halflight
