/// @file Rejects output paths whose folder does not exist, before work that would be lost.
#pragma once

#include <filesystem>
#include <string>

#include "nn/base/input_error.h"

namespace swarmcert::analysis {

/// @throws files::InputError if `path` names a file in a folder that does not exist. "" and "-" name no file.
inline void refuse_missing_folder(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code ignored;
  if (path.empty() || path == "-" || folder.empty() || std::filesystem::is_directory(folder, ignored)) return;
  throw files::InputError(
      {path, "", "", "", "lies in a folder that does not exist", "make the folder first"});
}

}  // namespace swarmcert::analysis
