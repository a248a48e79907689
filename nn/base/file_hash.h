/// @file SHA-256 of files of any size, such as long flight logs, without holding them in memory.
#pragma once

#include <string>

namespace swarmcert::files {

/// Returns the SHA-256 of the file's contents as 64 lower-case hex digits, the same as sha256(read_file(path)).
/// @throws InputError if the file cannot be read or is a folder.
std::string sha256_of_file(const std::string& path);

}  // namespace swarmcert::files
