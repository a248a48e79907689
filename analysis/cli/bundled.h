/// @file Where the files that ship with the tool are: networks, models, gains, the published vehicles.
#pragma once

#include <string>

namespace swarmcert::analysis {

/// Path of a bundled folder: PREFIX/share/swarmcert/`installed` beside an installed tool (PREFIX/bin/swarmcert), else
/// `source` in the source tree, which the build names in a file beside the tool that it builds.
/// @throws files::InputError if the folder is in neither place.
std::string bundled_folder(const std::string& installed, const std::string& source);

/// For a program that is not the tool but brings its files along: `folder` stands for the tool's own in
/// bundled_folder(), PREFIX/bin or where the build names the sources. To be called before any command runs.
void bundled_files_beside(const std::string& folder);

}  // namespace swarmcert::analysis
