#include "analysis/cli/bundled.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "nn/base/input_error.h"

namespace swarmcert::analysis {
namespace {

std::string& named_folder() {
  static std::string folder;
  return folder;
}

std::filesystem::path folder_of_the_tool() {
  return named_folder().empty() ? std::filesystem::read_symlink("/proc/self/exe").parent_path()
                                : std::filesystem::path(named_folder());
}

}  // namespace

void bundled_files_beside(const std::string& folder) { named_folder() = folder; }

std::string bundled_folder(const std::string& installed, const std::string& source) {
  namespace fs = std::filesystem;
  const fs::path beside = folder_of_the_tool();
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

void add_bundled_programs_to_path() {
  const std::filesystem::path programs = folder_of_the_tool().parent_path() / "lib/swarmcert";
  std::error_code none;
  if (!std::filesystem::is_directory(programs, none)) return;
  const char* path = std::getenv("PATH");
  setenv("PATH", ((path != nullptr ? std::string(path) + ":" : "") + programs.string()).c_str(), 1);
}

}  // namespace swarmcert::analysis
