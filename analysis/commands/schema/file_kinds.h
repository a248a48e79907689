/// @file The kinds of files that the tool reads and writes, with the descriptions of their content.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "nn/base/record.h"

namespace swarmcert::analysis {

struct FileKind {
  std::string name, title;
  std::string description;                        ///< file name, and what the schema cannot say
  std::function<void(files::Record&)> describes;  ///< from default values
};

/// Returns all kinds in alphabetical order.
const std::vector<FileKind>& file_kinds();

}  // namespace swarmcert::analysis
