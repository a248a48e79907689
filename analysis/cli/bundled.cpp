#include "analysis/cli/bundled.h"

#include <filesystem>
#include <fstream>

#include "nn/base/input_error.h"

namespace swarmcert::analysis {
namespace {

std::string& named_folder() {
  static std::string folder;
  return folder;
}

}  // namespace

void bundled_files_beside(const std::string& folder) { named_folder() = folder; }

std::string bundled_folder(const std::string& installed, const std::string& source) {
  namespace fs = std::filesystem;
  const fs::path beside =
      named_folder().empty() ? fs::read_symlink("/proc/self/exe").parent_path() : fs::path(named_folder());
  std::error_code none;
  const fs::path shared = beside.parent_path() / "share/swarmcert" / installed;
  if (fs::exists(shared, none)) return shared.string();
  std::ifstream named(beside / "source_folder.txt");
  std::string root;
  if (std::getline(named, root) && fs::exists(fs::path(root) / source, none))
    return (fs::path(root) / source).string();
  throw files::InputError({shared.string(), "", "", "", "the files that ship with the tool are missing",
                           "install the whole package, or name your own files"});
}

}  // namespace swarmcert::analysis
