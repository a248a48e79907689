/// @file zlib streams in files of unknown origin, decompressed up to a limit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace swarmcert::files {

/// What the zlib stream `data` decompresses to; nothing if it is damaged or ends early. A result longer than
/// `limit_bytes` is cut at most 64 KiB beyond it: the caller compares.
std::optional<std::string> inflated(std::string_view data, std::uint64_t limit_bytes);

}  // namespace swarmcert::files
