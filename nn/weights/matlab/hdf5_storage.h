/// @file Storage layout and filters of the elements of an HDF5 dataset.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/matlab/hdf5_file.h"

namespace swarmcert::files {

/// Returns the bytes of the row-major elements of `dataset`.
/// @param shape  of the dataset, with at most kMostElements elements.
/// @param element_bytes  size of one element.
/// @throws InputError if the layout or a filter is not one of those named in hdf5_dataset.h, if a chunk is missing,
///   stored twice or of the wrong size, or if the file is too small for this number of elements.
std::string stored_bytes(Hdf5File& file, const Hdf5Object& dataset, const std::vector<std::uint64_t>& shape,
                         std::size_t element_bytes);

}  // namespace swarmcert::files
