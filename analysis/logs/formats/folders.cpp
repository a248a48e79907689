/// @file Logs in several files: rosbag2 folders with metadata.yaml, and sessions of the Crazyflie client, a folder with
/// one CSV file for each log block.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>
#include <vector>

#include "analysis/logs/csv.h"
#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/formats/decompress.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/statistics_of_series.h"
#include "analysis/logs/variable_names.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

/// Appends the records of `more` to `topic`; columns that only one of them has are NaN in the other.
void append(RawTopic& topic, RawTopic& more) {
  const std::size_t before = topic.time_s.size();
  topic.time_s.insert(topic.time_s.end(), more.time_s.begin(), more.time_s.end());
  for (RawColumn& column : more.columns) {
    const auto same = std::find_if(topic.columns.begin(), topic.columns.end(),
                                   [&](const RawColumn& candidate) { return candidate.name == column.name; });
    if (same == topic.columns.end()) {
      column.values.insert(column.values.begin(), before, kNaN);
      topic.columns.push_back(std::move(column));
    } else {
      same->values.insert(same->values.end(), column.values.begin(), column.values.end());
    }
  }
  for (RawColumn& column : topic.columns) column.values.resize(topic.time_s.size(), kNaN);
}

void append(LogHealth& health, const LogHealth& more) {
  health.records += more.records;
  health.damaged_blocks += more.damaged_blocks;
  health.skipped_bytes += more.skipped_bytes;
  health.bytes += more.bytes;
  health.damaged_lines += more.damaged_lines;
  health.dropouts_s += more.dropouts_s;
  health.repaired.merged_blocks += more.repaired.merged_blocks;
  health.repaired.journal_pages += more.repaired.journal_pages;
  health.truncated |= more.truncated;
  health.checksum_failed |= more.checksum_failed;
}

namespace fs = std::filesystem;

constexpr std::size_t kLargestMetadata_bytes = std::size_t{1} << 20;

/// Returns the file names listed below `relative_file_paths:`, without their folders.
std::vector<std::string> listed_files(const std::string& metadata) {
  std::vector<std::string> names;
  for_each_value(metadata, [&](const std::vector<std::string>& keys, const std::string& value) {
    if (!keys.empty() && keys.back() == "relative_file_paths")
      names.push_back(fs::path(value).filename().string());
  });
  return names;
}

std::string metadata_of(const std::string& folder) {
  return files::read_file((fs::path(folder) / "metadata.yaml").string(), kLargestMetadata_bytes);
}

/// Reads a file of the bag, decompressing it first if it was compressed as a whole.
RawLog read_part(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (extension != ".zstd" && extension != ".zst") return read_raw(path.string());
  std::ifstream in = open_log(path.string());
  const std::string compressed = read_all(in, path.string());
  const Decompressed content =
      decompress(Compression::kZstd, compressed, decompression_limit(compressed.size()));
  if (content.bytes.empty()) refuse_at(path.string(), 0, "", "", "cannot be decompressed", files::kCopyAgain);
  std::istringstream bytes(content.bytes);
  RawLog log = parse_raw(bytes, path.string());
  log.health.truncated |= !content.is_whole;
  return log;
}

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

void append(RawLog& log, RawLog&& more) {
  for (RawTopic& topic : more.topics) {
    const auto same = std::find_if(log.topics.begin(), log.topics.end(), [&](const RawTopic& candidate) {
      return candidate.name == topic.name && candidate.instance == topic.instance;
    });
    if (same == log.topics.end())
      log.topics.push_back(std::move(topic));
    else
      append(*same, topic);
  }
  log.left_out.insert(log.left_out.end(), more.left_out.begin(), more.left_out.end());
  append(log.health, more.health);
}

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
  std::vector<LeftOut> lost;
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
  log->left_out.insert(log->left_out.end(), lost.begin(), lost.end());
  return std::move(*log);
}

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
    std::ifstream in = open_log(file.string());
    RawLog part = read_table(in, file.string(), {});
    for (RawTopic& topic : part.topics) topic.name = block_of(file.filename().string());
    append(log, std::move(part));
  }
  return log;
}

}  // namespace swarmcert::logs
