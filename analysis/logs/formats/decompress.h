/// @file Decompression of parts of logs.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace swarmcert::logs {

enum class Compression { kNone, kZstd, kLz4 };

struct Decompressed {
  std::string bytes;          ///< decompressed bytes; only the beginning if not `is_whole`
  bool is_whole = false;      ///< the frame ends where `compressed` ends, without an error
  bool is_too_large = false;  ///< stopped at the limit
};

/// Decompresses one frame (or several consecutive frames for zstd and lz4).
Decompressed decompress(Compression compression, std::string_view compressed, std::size_t limit_bytes);

/// Returns true if `bytes` starts with the magic number of zstd.
bool looks_like_zstd(std::string_view bytes);

/// Returns the largest decompressed size accepted for a log of `file_bytes`. It allows the redundancy of flight data
/// but stops decompression bombs.
std::size_t decompression_limit(std::size_t file_bytes);

}  // namespace swarmcert::logs
