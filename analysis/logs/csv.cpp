#include "nn/base/csv.h"

#include <algorithm>
#include <charconv>
#include <istream>
#include <limits>
#include <set>

#include "analysis/logs/record_source.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kLongestLine_bytes = std::size_t{1} << 16;

/// The next line without its end; false at the end of the file. Longer lines are cut: they are damage.
bool next_line(std::istream& in, std::string& line, bool& complete) {
  line.clear();
  complete = false;
  std::streambuf* const buffer = in.rdbuf();
  bool any = false;
  for (int c = buffer->sbumpc(); c != std::char_traits<char>::eof(); c = buffer->sbumpc()) {
    any = true;
    if (c == '\n') {
      complete = true;
      break;
    }
    if (line.size() <= kLongestLine_bytes) line.push_back(static_cast<char>(c));
  }
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return any;
}

/// The number between `at` and `end` without the blanks around it; NaN for an empty cell. Returns false for anything else.
bool parse_cell(const char* at, const char* end, double& value) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  while (at < end && is_blank(*at)) ++at;
  while (end > at && is_blank(end[-1])) --end;
  value = std::numeric_limits<double>::quiet_NaN();
  if (at == end) return true;
  if (*at == '+') ++at;
  double number = 0;
  const auto [next, error] = std::from_chars(at, end, number);
  if (error != std::errc() || next != end) return false;
  value = number;
  return true;
}

/// True if `line` has exactly values.size() cells, each a number or empty where the sink needs it.
bool parse_line(const std::string& line, char separator, const RecordSink& sink,
                std::vector<double>& values) {
  const char* at = line.data();
  const char* const end = at + line.size();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const char* const cell_end = std::find(at, end, separator);
    if (!parse_cell(at, cell_end, values[i]) && sink.needs(i)) return false;
    const bool last = i + 1 == values.size();
    if (last != (cell_end == end)) return false;
    at = cell_end + 1;
  }
  return true;
}

}  // namespace

void read_csv(std::istream& in, const std::string& path, RecordSink& sink, LogHealth& health) {
  std::string line;
  bool complete = false;
  if (!next_line(in, line, complete)) {
    throw files::InputError(
        {path, "line 1", "", "", "the file is empty", "the recording failed; leave it out"});
  }
  const std::string kByteOrderMark = "\xEF\xBB\xBF";
  if (line.compare(0, kByteOrderMark.size(), kByteOrderMark) == 0) line.erase(0, kByteOrderMark.size());
  if (!line.empty() && line[0] == '#') line.erase(0, 1);
  const char separator = files::csv_separator(line, ',');
  const std::vector<std::string_view> cells = files::csv_cells(line, separator);
  const std::vector<std::string> names(cells.begin(), cells.end());
  if (names.size() < 2 || line.size() > kLongestLine_bytes) {
    throw files::InputError({path, "line 1", "header", files::in_quotes(line), "does not name columns",
                             "the first line names them, separated by commas, semicolons or tabs"});
  }
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size())
    throw files::InputError({path, "line 1", "header", "", "names a column twice", "rename one of them"});
  sink.begin(names);
  std::vector<double> values(names.size());
  while (next_line(in, line, complete)) {
    if (line.empty()) continue;
    if (parse_line(line, separator, sink, values)) {
      sink.record(values);
    } else if (complete) {
      ++health.damaged_lines;
    } else {
      health.truncated = true;
    }
  }
}

}  // namespace swarmcert::logs
