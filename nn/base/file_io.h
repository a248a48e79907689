/// @file Reading with a size limit, atomic writing, hashing.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace swarmcert::files {

/// Largest file that a reader loads into memory: 256 MiB, forty thousand times the size of the paper's networks.
inline constexpr std::size_t kLargestFile_bytes = std::size_t{256} << 20;

/// Returns the contents of the whole file.
/// @throws InputError if it cannot be read, is a folder or a pipe, or is larger than `limit_bytes`.
std::string read_file(const std::string& path, std::size_t limit_bytes = kLargestFile_bytes);

/// Writes `contents` under a temporary name in the same folder, then renames it: readers see either the old file or the
/// complete new one. `path` "-" is standard output.
/// @throws InputError if the file exists and `overwrite` is false, or if writing fails.
void write_file(const std::string& path, std::string_view contents, bool overwrite);

/// Returns the SHA-256 of `bytes` as 64 lower-case hex digits (FIPS 180-4; computed by OpenSSL).
std::string sha256(std::string_view bytes);
/// Returns the SHA-256 of the contents of a file of any size, without holding them in memory.
/// @throws InputError if it cannot be read, or is a folder or a pipe.
std::string sha256_of_file(const std::string& path);

}  // namespace swarmcert::files
