/// @file Groups of HDF5: which names lead to which objects.
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

/// What the group contains, at most 4096 links, as a symbol table (B-tree of version 1) or as link messages.
/// @throws InputError if the group is damaged, keeps its links in a fractal heap, or has links that are not hard.
std::vector<Hdf5Link> links_of(Hdf5File& file, const Hdf5Object& group);

}  // namespace swarmcert::files
