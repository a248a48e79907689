/// @file Guides in percent format: C++ that compiles as one program, cut into cells by comments.
///
///   // %% [markdown]     text in comments follows, until the next mark
///   // %%                code follows
#pragma once

#include <string>
#include <vector>

namespace swarmcert::notebook {

struct Cell {
  bool is_code = false;
  std::string text;  ///< markdown without its comment signs; no blank lines at the ends
};

/// @throws files::InputError with the line where text stands before the first mark, or code inside a markdown cell.
std::vector<Cell> parse_cells(const std::string& source, const std::string& path);

/// The source with cell(i) in place of the mark of code cell i, for all marks inside main(): the same lines otherwise.
/// @throws files::InputError as parse_cells(), or if there is no line "int main() {".
std::string with_marks(const std::string& source, const std::string& path);

}  // namespace swarmcert::notebook
