/// @file The only code that calls the HDF5 library.
#pragma once

#include <cstdio>
#include <string>

namespace swarmcert::files::hdf5 {

/// Writes what an HDF5 file in memory holds to `file`, as read_nodes() reads it. The library trusts what files state:
/// damaged ones make it overwrite memory or run for ever, so call this with in_own_process() only.
/// @throws std::runtime_error if it is not a complete HDF5 file.
void write_nodes(const std::string& bytes, std::FILE* file);

}  // namespace swarmcert::files::hdf5
