/// @file What a guide needs besides the library: plots, and marks that say which cell printed what.
#pragma once

#include <string>

namespace swarmcert::notebook {

/// Begins the output of code cell `index`. Calls are inserted where the source has "// %%"; guides have none.
void cell(int index);

/// A plot by gnuplot: writes NAME.dat and NAME.gp; the renderer draws them.
/// @param data   what is plotted, and what a fresh run is compared with: a few significant digits.
/// @param script reads 'NAME.dat'; terminal and output are set before it.
void plot(const std::string& name, const std::string& data, const std::string& script);

/// How marks begin on standard output: a character that no text has (ASCII record separator).
inline constexpr char kMark = '\x1e';

}  // namespace swarmcert::notebook
