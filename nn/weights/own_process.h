/// @file Runs code that may crash, such as a library on a damaged file, in a process of its own.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>

namespace swarmcert::files {

/// Calls `work` with an empty temporary file in a copy of this process, and `read` with that file, from its beginning,
/// in this one. Nothing that `work` does, overwriting memory included, changes this process.
/// @param work must not rely on other threads, of which the copy has none.
/// @param most_bytes limit of the memory that `work` allocates, and of the file
/// @returns whether `work` returned within a minute of processor time; `read` is called only then. False if it threw,
///   crashed or exceeded a limit, or if there is neither another process nor a temporary file to be had.
bool in_own_process(const std::function<void(std::FILE*)>& work, const std::function<void(std::FILE*)>& read,
                    std::uint64_t most_bytes);

}  // namespace swarmcert::files
