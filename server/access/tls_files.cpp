#include "server/access/tls_files.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

namespace halflight {
namespace {

constexpr size_t kLargestFile = size_t{1} << 20U;

struct Free {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(SSL_CTX* context) const { SSL_CTX_free(context); }
  void operator()(std::FILE* file) const { std::fclose(file); }
};
template <typename T>
using Owned = std::unique_ptr<T, Free>;

absl::Status Wrong(const std::string& path, const std::string& why) {
  ERR_clear_error();
  return absl::InvalidArgumentError(fmt::format("{}: {}", path, why));
}

Owned<BIO> Reader(const std::string& text) {
  return Owned<BIO>(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// Otherwise OpenSSL asks for one on the terminal.
int NoPassword(char* /*buffer*/, int /*size*/, int /*writing*/, void* /*data*/) { return 0; }

// A line that was to begin another certificate, which OpenSSL does not take for one.
bool EndsInACutLine(const std::string& text) {
  const std::string last = text.substr(text.rfind('\n') + 1);
  return last.starts_with('-') && !last.starts_with("-----END");
}

// All of the file, which must be nothing but certificates: one at least.
absl::StatusOr<std::vector<Owned<X509>>> Certificates(const std::string& path,
                                                      const std::string& text) {
  const Owned<BIO> reader = Reader(text);
  std::vector<Owned<X509>> certificates;
  while (Owned<X509> next{PEM_read_bio_X509(reader.get(), nullptr, NoPassword, nullptr)}) {
    certificates.push_back(std::move(next));
  }
  if (certificates.empty()) {
    return Wrong(path, "holds no certificate in PEM");
  }
  // What ends the file in order is that no line begins another one.
  if (ERR_GET_REASON(ERR_peek_last_error()) != PEM_R_NO_START_LINE || EndsInACutLine(text)) {
    return Wrong(path, "a certificate behind the first is damaged");
  }
  ERR_clear_error();
  return certificates;
}

// Whether OpenSSL would shake hands with them: its security level asks for long enough keys and
// good enough signatures, of those behind the first too, which gRPC 1.51 finds out with each
// client.
absl::Status CheckStrength(const std::string& path, const std::vector<Owned<X509>>& chain) {
  const Owned<SSL_CTX> context(SSL_CTX_new(TLS_server_method()));
  for (const Owned<X509>& certificate : chain) {
    const bool first = certificate == chain.front();
    const auto ok = first ? SSL_CTX_use_certificate(context.get(), certificate.get())
                          : SSL_CTX_add1_chain_cert(context.get(), certificate.get());
    if (ok != 1) {
      const char* const reason = ERR_reason_error_string(ERR_peek_last_error());
      return Wrong(path, fmt::format("a certificate that TLS does not take: {}",
                                     reason == nullptr ? "no reason" : reason));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckTime(const std::string& path, const X509& certificate) {
  if (X509_cmp_current_time(X509_get0_notAfter(&certificate)) <= 0) {
    return Wrong(path, "the certificate has expired");
  }
  if (X509_cmp_current_time(X509_get0_notBefore(&certificate)) > 0) {
    return Wrong(path, "the certificate is not valid yet");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::string> ReadSmallFile(const std::string& path) {
  const Owned<std::FILE> file(std::fopen(path.c_str(), "rbe"));
  if (file == nullptr) {
    return Wrong(path, std::strerror(errno));
  }
  std::string bytes(kLargestFile + 1, '\0');
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file.get()));
  if (std::ferror(file.get()) != 0) {
    return Wrong(path, std::strerror(errno));
  }
  if (bytes.size() > kLargestFile) {
    return Wrong(path, fmt::format("is too large, allowed: {} bytes", kLargestFile));
  }
  return bytes;
}

absl::StatusOr<TlsFiles> LoadTlsFiles(const TlsPaths& paths) {
  TlsFiles files;
  for (const auto& [path, text] :
       {std::pair(&paths.certificate, &files.certificate), std::pair(&paths.key, &files.key),
        std::pair(&paths.client_authorities, &files.client_authorities)}) {
    if (path->empty()) {
      continue;
    }
    auto bytes = ReadSmallFile(*path);
    if (!bytes.ok()) {
      return bytes.status();
    }
    *text = *std::move(bytes);
  }
  const auto chain = Certificates(paths.certificate, files.certificate);
  if (!chain.ok()) {
    return chain.status();
  }
  X509& certificate = *chain->front();
  if (absl::Status status = CheckTime(paths.certificate, certificate); !status.ok()) {
    return status;
  }
  if (absl::Status status = CheckStrength(paths.certificate, *chain); !status.ok()) {
    return status;
  }
  const Owned<EVP_PKEY> key(
      PEM_read_bio_PrivateKey(Reader(files.key).get(), nullptr, NoPassword, nullptr));
  if (key == nullptr) {
    return Wrong(paths.key, "holds no private key in PEM without a password");
  }
  if (X509_check_private_key(&certificate, key.get()) != 1) {
    return Wrong(paths.key,
                 fmt::format("is not the key of the certificate in {}", paths.certificate));
  }
  if (!paths.client_authorities.empty()) {
    const auto authorities = Certificates(paths.client_authorities, files.client_authorities);
    if (!authorities.ok()) {
      return authorities.status();
    }
  }
  return files;
}

}  // namespace halflight
