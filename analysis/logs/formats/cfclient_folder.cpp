#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <utility>

#include "analysis/logs/csv.h"
#include "analysis/logs/formats/formats.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBlocks = 256;

/// Returns the block in a file name given by cfclient: "pose" for "pose-20260131T12-00-59.csv"; empty for other names.
std::string block_of(const std::string& name) {
  static const std::regex kPattern("(.+)-[0-9]{8}T[0-9]{2}-[0-9]{2}-[0-9]{2}[.]csv");
  std::smatch match;
  return name.size() <= 255 && std::regex_match(name, match, kPattern) ? match[1].str() : "";
}

std::vector<fs::path> csv_files(const std::string& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end && found.size() <= kMostBlocks;
       at.increment(error))
    if (at->path().extension() == ".csv") found.push_back(at->path());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

bool looks_like_cfclient_folder(const std::string& path) {
  const std::vector<fs::path> names = csv_files(path);
  return !names.empty() && names.size() <= kMostBlocks &&
         std::all_of(names.begin(), names.end(),
                     [](const fs::path& file) { return !block_of(file.filename().string()).empty(); });
}

RawLog read_cfclient_folder(const std::string& path) {
  RawLog log;
  log.path = path;
  log.format = "csv";
  for (const fs::path& file : csv_files(path)) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw files::InputError({file.string(), "", "", "", "cannot be read", "check its permissions"});
    RawLog part = read_table(in, file.string(), known_columns());
    for (RawTopic& topic : part.topics) topic.name = block_of(file.filename().string());
    log.health.damaged_lines += part.health.damaged_lines;
    append(log, std::move(part));
  }
  return log;
}

}  // namespace swarmcert::logs
