#include "nn/base/file_hash.h"

#include <openssl/evp.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::files {
namespace {

void require_digest(int result) {
  if (result != 1) throw std::runtime_error("sha256: OpenSSL has no SHA-256 in this configuration");
}

}  // namespace

std::string sha256_of_file(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size_bytes = std::filesystem::file_size(path, error);
  if (error || size_bytes <= kLargestFile_bytes) return sha256(read_file(path));
  std::ifstream in(path, std::ios::binary);
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  require_digest(EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr));
  std::array<char, 1 << 16> block;
  while (in) {
    in.read(block.data(), block.size());
    require_digest(EVP_DigestUpdate(context.get(), block.data(), static_cast<std::size_t>(in.gcount())));
  }
  if (!in.eof()) throw InputError({path, "", "", "", "cannot be read", "check its permissions and the disk"});
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned int size = 0;
  require_digest(EVP_DigestFinal_ex(context.get(), digest.data(), &size));
  std::string text;
  for (unsigned int i = 0; i < size; ++i) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02x", digest[i]);
    text += digits;
  }
  return text;
}

}  // namespace swarmcert::files
