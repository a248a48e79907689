#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <vector>

#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/formats/decompress.h"
#include "analysis/logs/formats/formats.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestMetadata_bytes = std::size_t{1} << 20;

/// Returns the file names listed below `relative_file_paths:`, without their folders.
std::vector<std::string> listed_files(const std::string& metadata) {
  std::vector<std::string> names;
  std::istringstream lines(metadata);
  bool is_in_list = false;
  for (std::string line; std::getline(lines, line);) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    const std::size_t first = line.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    const bool is_item = line.compare(first, 2, "- ") == 0;
    if (is_in_list && is_item) {
      std::string name = line.substr(first + 2);
      if (name.size() >= 2 && (name[0] == '"' || name[0] == '\'')) name = name.substr(1, name.size() - 2);
      names.push_back(fs::path(name).filename().string());
    }
    is_in_list = is_item ? is_in_list : line.compare(first, 20, "relative_file_paths:") == 0;
  }
  return names;
}

std::string metadata_of(const std::string& folder) {
  return files::read_file((fs::path(folder) / "metadata.yaml").string(), kLargestMetadata_bytes);
}

/// Reads a file of the bag, decompressing it first if it was compressed as a whole.
RawLog read_part(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (extension != ".zstd" && extension != ".zst") return read_raw(path.string());
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw files::InputError({path.string(), "", "", "", "cannot be read", "check its name and permissions"});
  const std::string compressed = read_all(in, path.string());
  const Decompressed content =
      decompress(Compression::kZstd, compressed, decompression_limit(compressed.size()));
  if (content.bytes.empty()) refuse_at(path.string(), 0, "", "", "cannot be decompressed", files::kCopyAgain);
  std::istringstream bytes(content.bytes);
  RawLog log = parse_raw(bytes, path.string());
  log.health.truncated |= !content.is_whole;
  return log;
}

}  // namespace

bool looks_like_rosbag_folder(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(fs::path(path) / "metadata.yaml", error)) return false;
  try {
    return metadata_of(path).find("rosbag2_bagfile_information") != std::string::npos;
  } catch (const files::InputError&) {
    return false;
  }
}

RawLog read_rosbag_folder(const std::string& path) {
  std::optional<RawLog> log;
  std::vector<RawSkip> lost;
  std::string reason = "metadata.yaml lists no files";
  for (const std::string& name : listed_files(metadata_of(path))) {
    try {
      RawLog part = read_part(fs::path(path) / name);
      if (log)
        append(*log, std::move(part));
      else
        log = std::move(part);
    } catch (const files::InputError& error) {
      reason = error.fault().what;
      lost.push_back({name, reason, 0});
    }
  }
  if (!log) {
    throw files::InputError({path, "metadata.yaml", "relative_file_paths", "",
                             "none of the bag's files can be read: " + reason,
                             "copy the whole folder again, or name the file that holds the messages"});
  }
  log->path = path;
  log->health.truncated |= !lost.empty();
  log->skipped.insert(log->skipped.end(), lost.begin(), lost.end());
  return std::move(*log);
}

}  // namespace swarmcert::logs
