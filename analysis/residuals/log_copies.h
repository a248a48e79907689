/// @file Logs with the same bytes under different names. A copy is not a further flight: counted again it would narrow
/// intervals, and held out it would not be held out.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace swarmcert::residuals {

class LogCopies {
 public:
  /// Adds a file. Returns an earlier one with the same bytes, itself if it was added before; else an empty string.
  /// Folders have no copies. Only files of equal size are read.
  std::string add(const std::string& file);

 private:
  struct Known {
    std::string file, sha256;  ///< the hash is computed when a second file of this size is added
  };
  std::map<std::uintmax_t, std::vector<Known>> by_size_;
};

}  // namespace swarmcert::residuals
