#include "analysis/logs/formats/crazyflie_csv.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <utility>

#include "analysis/logs/collector.h"
#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/formats/merge.h"
#include "analysis/logs/record_source.h"
#include "nn/base/input_error.h"
#include "nn/base/median.h"

namespace swarmcert::logs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBlocks = 256;

/// A name in a header: "acc.x[g]", "acc.x (g)".
struct HeadCell {
  std::string name, unit;
};

HeadCell head_cell(std::string_view text) {
  const std::string_view kAround = " \t\r\"#";
  text.remove_prefix(std::min(text.find_first_not_of(kAround), text.size()));
  text = text.substr(0, text.find_last_not_of(kAround) + 1);
  const std::size_t open = text.find_last_of("[(");
  const bool has_bracket =
      open != std::string_view::npos && open > 0 && (text.back() == ']' || text.back() == ')');
  if (!has_bracket) return {std::string(text), ""};
  const std::string_view inside = text.substr(open + 1, text.size() - open - 2);
  const bool is_index = !inside.empty() && std::all_of(inside.begin(), inside.end(),
                                                       [](unsigned char c) { return std::isdigit(c); });
  if (is_index) return {std::string(text), ""};
  const std::string_view name = text.substr(0, open);
  return {std::string(name.substr(0, name.find_last_not_of(' ') + 1)), std::string(inside)};
}

bool is_time_name(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static const std::set<std::string> names = {"timestamp", "time", "tick", "t"};
  return names.count(name) > 0;
}

/// Returns true for `group.name`, the form of the firmware's log variables.
bool is_log_variable(std::string_view name) {
  const std::size_t dot = name.find('.');
  return dot != std::string_view::npos && is_identifier(name.substr(0, dot)) &&
         is_identifier(name.substr(dot + 1));
}

std::optional<double> per_second(const std::string& unit) {
  static const std::map<std::string, double> units = {{"s", 1},    {"sec", 1},         {"ms", 1e3},
                                                      {"us", 1e6}, {"\xC2\xB5s", 1e6}, {"ns", 1e9}};
  const auto found = units.find(unit);
  return found == units.end() ? std::nullopt : std::optional<double>(found->second);
}

/// Returns the unit in which the steps of `times` correspond to a log of 0.7 Hz to 2 kHz.
std::string unit_of_steps(const std::vector<double>& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i] > times[i - 1]) steps.push_back(times[i] - times[i - 1]);
  if (steps.empty()) return "ms";
  const double middle = upper_median(std::move(steps));
  if (middle < 0.5) return "s";
  if (middle < 1500) return "ms";
  return middle < 1.5e6 ? "us" : "ns";
}

/// Receives the records of one file.
class CsvTopic : public RecordSink {
 public:
  void begin(const std::vector<std::string>& names) override {
    for (const std::string& name : names) topic.columns.push_back({name, head_cell(name).unit, {}});
  }
  void record(const std::vector<double>& values) override {
    if (!std::isfinite(values[0])) {
      ++without_time;
      return;
    }
    topic.time_s.push_back(values[0]);
    for (std::size_t i = 0; i < values.size(); ++i) topic.columns[i].values.push_back(values[i]);
  }
  bool needs(std::size_t column) const override { return column == 0; }

  RawTopic topic;
  std::size_t without_time = 0;
};

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

bool looks_like_crazyflie_csv(std::string_view head) {
  const std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (head.substr(0, kByteOrderMark.size()) == kByteOrderMark) head.remove_prefix(kByteOrderMark.size());
  std::string_view line = head.substr(0, head.find('\n'));
  const std::size_t separator = line.find_first_of(",;\t");
  if (separator == std::string_view::npos || !is_time_name(head_cell(line.substr(0, separator)).name))
    return false;
  const char mark = line[separator];
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(mark), line.size());
    if (is_log_variable(head_cell(line.substr(0, end)).name)) return true;
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return false;
}

RawLog read_crazyflie_csv(std::istream& in, const std::string& path) {
  RawLog log;
  log.path = path;
  log.format = "csv";
  CsvTopic sink;
  read_csv(in, path, sink, log.health);
  RawTopic& topic = sink.topic;
  topic.name = "csv";
  log.health.not_finite = sink.without_time;
  log.health.records = topic.time_s.size();
  if (topic.time_s.empty()) return log;
  const bool counts_us = time_column(topic, known_columns()).columns[0] == 0;
  std::string unit = counts_us ? "us" : topic.columns[0].unit;
  if (!per_second(unit)) unit = unit_of_steps(topic.time_s);
  for (double& time : topic.time_s) time /= *per_second(unit);
  log.texts["time_unit"] = unit;
  const auto has_no_number = [](const RawColumn& column) {
    return std::all_of(column.values.begin(), column.values.end(),
                       [](double value) { return std::isnan(value); });
  };
  for (const RawColumn& column : topic.columns)
    if (has_no_number(column))
      log.skipped.push_back({column.name.empty() ? "column without name" : column.name, "it holds no numbers",
                             column.values.size()});
  topic.columns.erase(std::remove_if(topic.columns.begin(), topic.columns.end(), has_no_number),
                      topic.columns.end());
  log.topics.push_back(std::move(topic));
  separate_blocks(log);
  return log;
}

bool looks_like_cfclient_folder(const std::string& path) {
  const std::vector<fs::path> names = csv_files(path);
  if (names.empty() || names.size() > kMostBlocks) return false;
  return std::all_of(names.begin(), names.end(), [](const fs::path& file) {
    const LogFormat* const format =
        block_of(file.filename().string()).empty() ? nullptr : format_of_file(file.string());
    return format != nullptr && format->looks_like == looks_like_crazyflie_csv;
  });
}

RawLog read_cfclient_folder(const std::string& path) {
  RawLog log;
  log.path = path;
  log.format = "csv";
  for (const fs::path& file : csv_files(path)) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw files::InputError({file.string(), "", "", "", "cannot be read", "check its permissions"});
    RawLog part = read_crazyflie_csv(in, file.string());
    for (RawTopic& topic : part.topics) topic.name = block_of(file.filename().string());
    log.health.not_finite += part.health.not_finite;
    log.health.damaged_lines += part.health.damaged_lines;
    append(log, std::move(part));
  }
  return log;
}

}  // namespace swarmcert::logs
