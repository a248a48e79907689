/// @file MATLAB's MAT files, version 7.3: HDF5 with attributes that name MATLAB's classes.
#pragma once

#include <string>
#include <vector>

#include "nn/weights/matlab/mat_file.h"

namespace swarmcert::files {

/// The variables of a MAT file of version 7.3, whose HDF5 part begins at 512.
/// @throws InputError if the file is damaged, or uses more of HDF5 than hdf5_file.h, hdf5_group.h and hdf5_dataset.h
/// read.
std::vector<MatVariable> mat73_variables(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::files
