/// @file Location of the files that ship with the tool: networks, models, gains, the published vehicles.
#pragma once

#include <string>

namespace swarmcert::analysis {

/// Returns the path of a bundled folder. For an installed tool (PREFIX/bin/swarmcert) that is
/// PREFIX/share/swarmcert/`installed`; otherwise it is `source` in the source tree, whose path the build
/// writes to a file next to the tool.
/// @throws files::InputError if neither folder exists.
std::string bundled_folder(const std::string& installed, const std::string& source);

/// For a program other than the tool that ships the same files: bundled_folder() then uses `folder` in place of the
/// tool's own folder (PREFIX/bin, or the folder in which the build left the path of the sources). Call it before any
/// command runs.
void bundled_files_beside(const std::string& folder);

/// Appends PREFIX/lib/swarmcert of an installed tool to PATH, where packages that stand alone (the Python wheel, the
/// container) keep the program that draws the plots of reports. A program of the system's own is found before it.
void add_bundled_programs_to_path();

}  // namespace swarmcert::analysis
