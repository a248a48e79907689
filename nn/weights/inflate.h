/// @file Decompression of zlib streams from untrusted files, up to a size limit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace swarmcert::files {

/// Returns the decompressed zlib stream `data`, or nothing if it is damaged or ends early. Decompression stops at most
/// 64 KiB beyond `limit_bytes`; the caller must compare the size with the limit.
std::optional<std::string> inflated(std::string_view data, std::uint64_t limit_bytes);

}  // namespace swarmcert::files
