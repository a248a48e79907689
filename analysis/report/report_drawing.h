/// @file Drawing with gnuplot.
#pragma once

#include <string>

namespace swarmcert::analysis {

/// Returns the script of a figure: terminal, colours, key and grid common to all reports, followed by `commands`.
/// `gnuplot NAME.gp > NAME.svg` draws it by hand.
std::string plot_script(const std::string& commands, int height);

/// Returns a step of 1, 2 or 5 times a power of ten that gives an axis of this length three to seven ticks; 1 if
/// there is none.
double tick_step(double length);

/// Returns the SVG that gnuplot draws from FOLDER/`script`; empty if gnuplot is missing or fails. gnuplot runs in the
/// folder, never sees the folder's name (its strings can run commands), and ignores the user's start-up files.
std::string draw(const std::string& folder, const std::string& script, bool is_narrow);

}  // namespace swarmcert::analysis
