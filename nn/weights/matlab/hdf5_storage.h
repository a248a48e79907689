/// @file Where the elements of an HDF5 dataset lie in the file, and through which filters they went.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/matlab/hdf5_file.h"

namespace swarmcert::files {

/// The bytes of the row-major elements of `dataset`.
/// @param shape  of the dataset, with at most kMostElements elements. @param element_bytes  of one element.
/// @throws InputError if the layout or a filter is none of those that hdf5_dataset.h names, if a chunk is missing,
/// stored twice or not of the size that it must have, or if the file is too small for this number of elements.
std::string stored_bytes(Hdf5File& file, const Hdf5Object& dataset, const std::vector<std::uint64_t>& shape,
                         std::size_t element_bytes);

}  // namespace swarmcert::files
