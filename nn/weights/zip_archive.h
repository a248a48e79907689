/// @file A zip archive in memory, with limits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

struct zip;

namespace swarmcert::files {

/// Reads uncompressed entries only, as torch.save writes them, so that an entry is never larger than the file.
class ZipArchive {
 public:
  /// @param bytes, path  must outlive the archive; `path` is for messages.
  /// @throws InputError if this is not a zip archive or declares more than 10 000 entries.
  ZipArchive(const std::string& bytes, const std::string& path);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  const std::vector<std::string>& names() const { return names_; }
  bool has(const std::string& name) const;

  /// Returns the whole entry and verifies its checksum.
  /// @throws InputError if it is missing, compressed, encrypted, larger than `limit_bytes`, or damaged.
  std::string read(const std::string& name, std::uint64_t limit_bytes) const;

 private:
  const std::string& path_;
  std::size_t size_bytes_;
  zip* archive_ = nullptr;
  std::vector<std::string> names_;
};

}  // namespace swarmcert::files
