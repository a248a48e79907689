/// @file MATLAB's MAT files, version 5, with the weights of a network, as LipSDP and ECLipsE use them.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// True if `bytes` have HDF5's signature where the format allows it: at offset 0, 512, 1024, 2048, ... MATLAB's -v7.3
/// files are such files, and Keras's .h5. None is read: HDF5 is a file system with its own filters and links, and its
/// library no safe reader of files from strangers; every program that writes it also writes a simple format.
bool looks_like_hdf5(const std::string& bytes);

/// True if `bytes` begin as a MAT file of version 5 or later does.
bool looks_like_mat(const std::string& bytes);

/// The network in `bytes`: a cell array "weights" of matrices [outputs, inputs], with "biases" where there are any; or
/// matrices with names that network_of_arrays() knows. Numeric arrays of every class, compressed (-v7) or not (-v6).
/// @throws InputError for anything else, with the offset.
Weights parse_mat(const std::string& bytes, const std::string& path, const std::vector<std::string>& order);

}  // namespace swarmcert::files
