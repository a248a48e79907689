#include "analysis/residuals/log_copies.h"

#include <filesystem>
#include <system_error>

#include "nn/base/file_io.h"

namespace swarmcert::residuals {

namespace fs = std::filesystem;

std::string LogCopies::add(const std::string& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return "";
  std::vector<Known>& same_size = by_size_[fs::file_size(file, error)];
  Known added{file, ""};
  for (Known& known : same_size) {
    if (known.file == file) return file;
    if (known.sha256.empty()) known.sha256 = files::sha256_of_file(known.file);
    if (added.sha256.empty()) added.sha256 = files::sha256_of_file(file);
    if (known.sha256 == added.sha256) return known.file;
  }
  same_size.push_back(std::move(added));
  return "";
}

}  // namespace swarmcert::residuals
