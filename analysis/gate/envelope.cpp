#include "analysis/gate/envelope.h"

#include <fmt/core.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <memory>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::gate {
namespace {

using files::Json;
using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using DigestContext = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

const unsigned char* bytes(const std::string& text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

int no_passphrase(char*, int, int, void*) { return 0; }

/// Reads a PEM file with one of OpenSSL's readers.
template <class Read>
Key read_key(const std::string& path, const char* kind, Read read) {
  const std::string pem = files::read_file(path, 65536);
  const std::unique_ptr<BIO, decltype(&BIO_free)> memory(
      BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), BIO_free);
  Key key(read(memory.get(), nullptr, no_passphrase, nullptr), EVP_PKEY_free);
  if (!key)
    throw files::InputError(
        {path, "", "", "", fmt::format("is no {} key in PEM without passphrase", kind),
         "openssl genpkey -algorithm ed25519 -out private.pem; openssl pkey -in private.pem "
         "-pubout -out public.pem"});
  return key;
}

std::string base64(const std::string& data) {
  std::string text(4 * ((data.size() + 2) / 3) + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes(data),
                                   static_cast<int>(data.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

/// The inverse of base64(); empty for any text that it does not return.
std::string from_base64(const std::string& text) {
  std::string data(text.size() + 1, '\0');
  const int size = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(data.data()), bytes(text),
                                   static_cast<int>(text.size()));
  if (size < 0) return "";
  const std::size_t padding = text.size() - std::min(text.size(), text.find('='));
  data.resize(static_cast<std::size_t>(size) -
              std::min<std::size_t>(padding, static_cast<std::size_t>(size)));
  return base64(data) == text ? data : "";
}

std::string signed_bytes(const std::string& statement) {
  return fmt::format("DSSEv1 {} {} {} {}", sizeof kStatementType - 1, kStatementType, statement.size(),
                     statement);
}

const EVP_MD* digest_for(const EVP_PKEY* key) {
  const bool signs_as_is = EVP_PKEY_is_a(key, "ED25519") == 1 || EVP_PKEY_is_a(key, "ED448") == 1;
  return signs_as_is ? nullptr : EVP_sha256();
}

std::string key_id(const EVP_PKEY* key) {
  std::string der(static_cast<std::size_t>(std::max(i2d_PUBKEY(key, nullptr), 0)), '\0');
  auto* end = reinterpret_cast<unsigned char*>(der.data());
  if (!der.empty()) i2d_PUBKEY(key, &end);
  return files::sha256(der);
}

}  // namespace

Json sign(const std::string& statement, const std::string& private_key) {
  const Key key = read_key(private_key, "private", PEM_read_bio_PrivateKey);
  const std::string message = signed_bytes(statement);
  const DigestContext context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  std::size_t size = 0;
  std::string signature;
  const auto run = [&](unsigned char* to) {
    return EVP_DigestSign(context.get(), to, &size, bytes(message), message.size()) == 1;
  };
  bool is_signed =
      EVP_DigestSignInit(context.get(), nullptr, digest_for(key.get()), nullptr, key.get()) == 1 &&
      run(nullptr);
  signature.resize(size);
  is_signed = is_signed && run(reinterpret_cast<unsigned char*>(signature.data()));
  signature.resize(size);
  if (!is_signed)
    throw files::InputError({private_key, "", "", "", "cannot sign", "use an Ed25519, ECDSA or RSA key"});
  const Json one = {{"keyid", key_id(key.get())}, {"sig", base64(signature)}};
  return {
      {"payload", base64(statement)}, {"payloadType", kStatementType}, {"signatures", Json::array({one})}};
}

void require_public_key(const std::string& public_key) {
  read_key(public_key, "public", PEM_read_bio_PUBKEY);
}

std::string why_not_signed(const Json& envelope, const std::string& statement,
                           const std::string& public_key) {
  const Key key = read_key(public_key, "public", PEM_read_bio_PUBKEY);
  files::require_keys(envelope, {"payload", "payloadType", "signatures"}, "the envelope");
  if (envelope["payload"] != base64(statement)) return "the envelope holds another statement";
  if (envelope["payloadType"] != kStatementType) return "the envelope states another type of document";
  if (envelope["signatures"].size() != 1) return "the envelope does not hold exactly one signature";
  const Json& one = envelope["signatures"][0];
  files::require_keys(one, {"keyid", "sig"}, "the signature");
  if (one["keyid"] != key_id(key.get())) return "it is signed by another key";
  const std::string message = signed_bytes(statement), signature = from_base64(one["sig"].get<std::string>());
  const DigestContext context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  const bool is_valid =
      EVP_DigestVerifyInit(context.get(), nullptr, digest_for(key.get()), nullptr, key.get()) == 1 &&
      EVP_DigestVerify(context.get(), bytes(signature), signature.size(), bytes(message), message.size()) ==
          1;
  return is_valid ? "" : "the signature is not valid";
}

}  // namespace swarmcert::gate
