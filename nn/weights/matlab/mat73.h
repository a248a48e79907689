/// @file MATLAB's MAT files, version 7.3: HDF5 with attributes that name MATLAB classes.
#pragma once

#include <string>
#include <vector>

#include "nn/weights/matlab/mat_file.h"

namespace swarmcert::files {

/// Reads the variables of a MAT file of version 7.3, whose HDF5 part begins at offset 512.
/// @throws InputError if the file is damaged, or as Hdf5Object.
std::vector<MatVariable> mat73_variables(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::files
