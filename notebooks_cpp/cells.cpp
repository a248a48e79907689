#include "notebooks_cpp/cells.h"

#include <algorithm>
#include <sstream>

#include "nn/base/input_error.h"

namespace swarmcert::notebook {
namespace {

constexpr const char* kCode = "// %%";
constexpr const char* kMarkdown = "// %% [markdown]";

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of('\n'), end = text.find_last_not_of("\n ");
  return begin == std::string::npos ? "" : text.substr(begin, end + 1 - begin);
}

/// Code as it reads alone: without the indent that all its lines have.
std::string without_indent(const std::string& code) {
  std::size_t indent = std::string::npos;
  std::istringstream lines(code);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) indent = std::min(indent, line.find_first_not_of(' '));
  }
  std::string result;
  lines = std::istringstream(code);
  for (std::string line; std::getline(lines, line);)
    result += (line.empty() ? "" : line.substr(indent)) + "\n";
  return result;
}

/// `line` without its indent.
std::string bare(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(' ');
  return begin == std::string::npos ? "" : line.substr(begin);
}

[[noreturn]] void refuse(const std::string& path, int line, const std::string& what,
                         const std::string& hint) {
  throw files::InputError({path, "line " + std::to_string(line), "", "", what, hint});
}

}  // namespace

std::vector<Cell> parse_cells(const std::string& source, const std::string& path) {
  std::vector<Cell> cells;
  std::istringstream lines(source);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::string words = bare(line);
    if (words == kCode || words == kMarkdown) {
      cells.push_back({words == kCode, ""});
      continue;
    }
    if (cells.empty()) {
      if (words.empty()) continue;
      refuse(path, number, "stands before the first cell", std::string("begin with ") + kMarkdown);
    }
    if (cells.back().is_code) {
      cells.back().text += line + "\n";
    } else if (words.rfind("//", 0) == 0) {
      cells.back().text += words.substr(words.rfind("// ", 0) == 0 ? 3 : 2) + "\n";
    } else if (!words.empty()) {
      refuse(path, number, "is code in a markdown cell", std::string("put ") + kCode + " before it");
    }
  }
  for (Cell& cell : cells) cell.text = trimmed(cell.is_code ? without_indent(cell.text) : cell.text);
  return cells;
}

std::string with_marks(const std::string& source, const std::string& path) {
  parse_cells(source, path);
  std::istringstream lines(source);
  std::string result;
  int cell = -1;
  bool in_main = false;
  for (std::string line; std::getline(lines, line);) {
    const std::string words = bare(line);
    if (words == kCode || words == kMarkdown) ++cell;
    if (words == kCode && in_main)
      result += "swarmcert::notebook::cell(" + std::to_string(cell) + ");\n";
    else
      result += line + "\n";
    if (line == "int main() {") {
      in_main = true;
      result.insert(result.size() - 1, " swarmcert::notebook::cell(" + std::to_string(cell) + ");");
    }
  }
  if (!in_main)
    throw files::InputError({path, "", "int main() {", "", "is missing", "cells run inside main"});
  return result;
}

}  // namespace swarmcert::notebook
