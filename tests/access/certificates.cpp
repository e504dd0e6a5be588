#include "tests/access/certificates.h"

#include <atomic>
#include <cstring>

#include <gtest/gtest.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rsa.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

namespace halflight::testing {
namespace {

struct Free {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
template <typename T>
using Owned = std::unique_ptr<T, Free>;

template <typename Write>
std::string Pem(const Write& write) {
  const Owned<BIO> bio(BIO_new(BIO_s_mem()));
  EXPECT_EQ(write(bio.get()), 1);
  char* bytes = nullptr;
  const auto size = BIO_get_mem_data(bio.get(), &bytes);
  return {bytes, static_cast<size_t>(size)};
}

std::string PemOf(X509& certificate) {
  return Pem([&](BIO* bio) { return PEM_write_bio_X509(bio, &certificate); });
}

std::string PemOf(EVP_PKEY& key) {
  return Pem([&](BIO* bio) {
    return PEM_write_bio_PrivateKey(bio, &key, nullptr, nullptr, 0, nullptr, nullptr);
  });
}

void Extend(X509& certificate, X509& issuer, int what, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, &issuer, &certificate, nullptr, nullptr, 0);
  X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, what, value.c_str());
  EXPECT_NE(extension, nullptr) << value;
  X509_add_ext(&certificate, extension, -1);
  X509_EXTENSION_free(extension);
}

// Not signed yet.
Owned<X509> Draft(const Subject& subject, EVP_PKEY& key) {
  static std::atomic<int> serial = 1;
  Owned<X509> draft(X509_new());
  X509_set_version(draft.get(), X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(draft.get()), serial++);
  X509_gmtime_adj(X509_getm_notBefore(draft.get()), subject.valid_from_seconds);
  X509_gmtime_adj(X509_getm_notAfter(draft.get()), subject.valid_until_seconds);
  X509_set_pubkey(draft.get(), &key);
  if (!subject.common_name.empty()) {
    X509_NAME_add_entry_by_txt(X509_get_subject_name(draft.get()), "CN", MBSTRING_ASC,
                               reinterpret_cast<const unsigned char*>(subject.common_name.c_str()),
                               -1, -1, 0);
  }
  return draft;
}

}  // namespace

struct Authority::Parts {
  Owned<EVP_PKEY> key{EVP_EC_gen("P-256")};
  Owned<X509> certificate;
};

Authority::Authority() : parts_(std::make_unique<Parts>()) {
  parts_->certificate = Draft({.common_name = "authority"}, *parts_->key);
  X509& own = *parts_->certificate;
  X509_set_issuer_name(&own, X509_get_subject_name(&own));
  Extend(own, own, NID_basic_constraints, "critical,CA:TRUE");
  Extend(own, own, NID_key_usage, "critical,keyCertSign");
  EXPECT_NE(X509_sign(&own, parts_->key.get(), EVP_sha256()), 0);
  certificate_ = PemOf(own);
}

Authority::~Authority() = default;

Issued Authority::Issue(const Subject& subject) const {
  const Owned<EVP_PKEY> key(subject.weak ? EVP_RSA_gen(1024) : EVP_EC_gen("P-256"));
  const Owned<X509> made = Draft(subject, *key);
  X509_set_issuer_name(made.get(), X509_get_subject_name(parts_->certificate.get()));
  std::string names;
  for (const std::string& name : subject.alternate) {
    names += (names.empty() ? "" : ",") + name;
  }
  if (!names.empty()) {
    Extend(*made, *parts_->certificate, NID_subject_alt_name, names);
  }
  EXPECT_NE(X509_sign(made.get(), parts_->key.get(), EVP_sha256()), 0);
  return {PemOf(*made), PemOf(*key)};
}

Issued Authority::IssueServer() const {
  return Issue({.common_name = "server", .alternate = {"DNS:localhost", "IP:127.0.0.1"}});
}

}  // namespace halflight::testing
