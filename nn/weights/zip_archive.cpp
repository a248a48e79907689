#include "nn/weights/zip_archive.h"

#include <zip.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string_view>

#include "nn/base/input_error.h"

namespace swarmcert::files {
namespace {

constexpr std::uint64_t kMostEntries = 10'000;

std::uint64_t little_endian_64(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 8; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

/// Returns true if the archive contains, or claims to contain, more than kMostEntries entries. libzip allocates memory
/// for each before it checks them, so this must come first. Offsets: PKWARE APPNOTE 6.3.9, sections 4.3.12, 4.3.14,
/// 4.3.15.
bool has_too_many_entries(std::string_view bytes) {
  constexpr std::string_view kEntry("PK\1\2", 4);
  std::uint64_t entries = 0;
  for (std::size_t at = bytes.find(kEntry); at != bytes.npos; at = bytes.find(kEntry, at + 4)) {
    if (++entries > kMostEntries) return true;
  }
  constexpr std::string_view kLocator64("PK\6\7", 4), kRecord64("PK\6\6", 4);
  constexpr std::size_t kTail = 0xffff + 22 + 20;  // longest comment, end record, locator
  const std::size_t tail = bytes.size() - std::min(bytes.size(), kTail);
  for (std::size_t at = bytes.find(kLocator64, tail); at != bytes.npos; at = bytes.find(kLocator64, at + 4)) {
    if (bytes.size() - at < 16) continue;
    const std::uint64_t record = little_endian_64(bytes.substr(at + 8, 8));
    if (bytes.size() < 56 || record > bytes.size() - 56) continue;
    if (bytes.substr(record, 4) != kRecord64) continue;  // of an archive inside this one
    if (little_endian_64(bytes.substr(record + 24, 8)) > kMostEntries) return true;
    if (little_endian_64(bytes.substr(record + 32, 8)) > kMostEntries) return true;
  }
  return false;
}

struct CloseEntry {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

}  // namespace

ZipArchive::ZipArchive(const std::string& bytes, const std::string& path)
    : path_(path), size_bytes_(bytes.size()) {
  if (has_too_many_entries(bytes)) {
    throw InputError(
        {path, "", "", "", "the archive has more than " + std::to_string(kMostEntries) + " entries", ""});
  }
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* const source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  if (source != nullptr) archive_ = zip_open_from_source(source, ZIP_RDONLY, &error);
  const std::string reason = zip_error_strerror(&error);
  zip_error_fini(&error);
  if (archive_ == nullptr) {
    if (source != nullptr) zip_source_free(source);
    throw InputError({path, "", "", "", "is not a complete zip archive (" + reason + ")", kCopyAgain});
  }
  const zip_int64_t count = zip_get_num_entries(archive_, 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* const entry = zip_get_name(archive_, static_cast<zip_uint64_t>(i), ZIP_FL_ENC_RAW);
    names_.emplace_back(entry == nullptr ? "" : entry);
  }
}

ZipArchive::~ZipArchive() { zip_discard(archive_); }

bool ZipArchive::has(const std::string& name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

std::string ZipArchive::read(const std::string& name, std::uint64_t limit_bytes) const {
  const auto refuse = [&](const std::string& what, const std::string& hint) {
    throw InputError({path_, "", name, "", what, hint});
  };
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) refuse("the archive has no such entry", kCopyAgain);
  if (std::find(found + 1, names_.end(), name) != names_.end())
    refuse("the archive has this entry twice", "");

  const auto index = static_cast<zip_uint64_t>(found - names_.begin());
  zip_stat_t status;
  zip_stat_init(&status);
  constexpr zip_uint64_t kNeeded = ZIP_STAT_SIZE | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
  if (zip_stat_index(archive_, index, 0, &status) != 0 || (status.valid & kNeeded) != kNeeded) {
    refuse("the entry cannot be read", kCopyAgain);
  }
  if (status.comp_method != ZIP_CM_STORE || status.encryption_method != ZIP_EM_NONE) {
    refuse("the entry is compressed or encrypted",
           "save again with torch.save or numpy.savez, which do neither");
  }
  if (status.size > limit_bytes || status.size > size_bytes_) {
    refuse("the entry declares " + std::to_string(status.size) + " bytes, more than the limit", kCopyAgain);
  }
  std::string contents(static_cast<std::size_t>(status.size), '\0');
  const std::unique_ptr<zip_file_t, CloseEntry> file(zip_fopen_index(archive_, index, 0));
  if (file == nullptr) refuse("the entry cannot be read", kCopyAgain);
  std::size_t filled = 0;
  while (filled < contents.size()) {
    const zip_int64_t count = zip_fread(file.get(), &contents[filled], contents.size() - filled);
    if (count <= 0) refuse("the entry is shorter than declared, or its checksum is wrong", kCopyAgain);
    filled += static_cast<std::size_t>(count);
  }
  char beyond;  // the checksum is compared when the end is reached
  if (zip_fread(file.get(), &beyond, 1) != 0) refuse("the entry's checksum is wrong", kCopyAgain);
  return contents;
}

}  // namespace swarmcert::files
