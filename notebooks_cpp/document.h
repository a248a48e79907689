/// @file A guide that ran: cells with what they printed and drew, as .ipynb.
#pragma once

#include <string>
#include <vector>

#include "nn/base/json.h"
#include "notebooks_cpp/cells.h"

namespace swarmcert::notebook {

/// What a code cell left: text, or a plot.
struct Output {
  std::string text;  ///< standard output; of a plot: a line that stands in its place
  std::string data;  ///< of a plot
  std::string svg, png;
  bool is_plot() const { return !data.empty(); }
};

struct RunCell : Cell {
  std::vector<Output> outputs;
};

/// Notebook format 4.5. A plot is one display_data with SVG, PNG and text; its data stand in its metadata.
files::Json to_ipynb(const std::vector<RunCell>& cells);

/// Returns the first cell in which two notebooks differ, with both texts; empty if there is none. Images are only
/// compared by presence.
std::string first_difference(const files::Json& committed, const files::Json& fresh);

}  // namespace swarmcert::notebook
