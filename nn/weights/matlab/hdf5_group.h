/// @file HDF5 groups: the mapping from names to objects.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/matlab/hdf5_file.h"

namespace swarmcert::files {

struct Hdf5Link {
  std::string name;
  std::uint64_t address = 0;  ///< of the object
};

bool is_group(const Hdf5Object& object);

/// Returns the contents of the group, at most 4096 links, stored as a symbol table (version 1 B-tree) or link messages.
/// @throws InputError if the group is damaged, stores its links in a fractal heap, or has links that are not hard
///   links.
std::vector<Hdf5Link> links_of(Hdf5File& file, const Hdf5Object& group);

}  // namespace swarmcert::files
