/// @file Compressed parts of logs.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace swarmcert::logs {

enum class Compression { kNone, kZstd, kLz4 };

struct Decompressed {
  std::string bytes;          ///< what could be decompressed; the beginning only where `is_whole` is false
  bool is_whole = false;      ///< the frame ends where `compressed` ends, without an error
  bool is_too_large = false;  ///< stopped because more than the limit would have come
};

/// Decompresses one frame (several in a row for zstd and lz4).
Decompressed decompress(Compression compression, std::string_view compressed, std::size_t limit_bytes);

/// True if the magic number of zstd starts `bytes`.
bool looks_like_zstd(std::string_view bytes);

/// How much a log of `file_bytes` may decompress to: flights repeat themselves, bombs do so beyond measure.
std::size_t decompression_limit(std::size_t file_bytes);

}  // namespace swarmcert::logs
