/// @file Drawing with gnuplot.
#pragma once

#include <string>

namespace swarmcert::analysis {

/// The script of a figure: `commands` behind the terminal of its width, with the colours, key and grid of all reports.
/// `gnuplot NAME.gp > NAME.svg` draws it by hand.
std::string plot_script(const std::string& commands, int height);

/// A step of 1, 2 or 5 times a power of ten that gives an axis of that length three to seven ticks; 1 for none.
double tick_step(double length);

/// What gnuplot draws of FOLDER/`script`, as SVG; "" where there is no gnuplot or it fails. It runs in the folder,
/// whose name never reaches it (its strings can run commands), without the user's start-up files.
std::string draw(const std::string& folder, const std::string& script, bool is_narrow);

}  // namespace swarmcert::analysis
