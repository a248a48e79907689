#include <charconv>
#include <istream>
#include <set>

#include "analysis/logs/record_source.h"
#include "nn/files/input_error.h"

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

std::string trimmed(std::string text) {
  const char* const kBlank = " \t\"";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = line.find(',', begin);
    cells.push_back(trimmed(line.substr(begin, end == std::string::npos ? end : end - begin)));
    if (end == std::string::npos) return cells;
    begin = end + 1;
  }
}

/// True if `line` is exactly values.size() numbers.
bool parse_numbers(const std::string& line, std::vector<double>& values) {
  const char* at = line.data();
  const char* const end = at + line.size();
  const auto skip_blanks = [&] {
    while (at < end && (*at == ' ' || *at == '\t')) ++at;
  };
  for (std::size_t i = 0; i < values.size(); ++i) {
    skip_blanks();
    if (at < end && *at == '+') ++at;
    const auto [next, error] = std::from_chars(at, end, values[i]);
    if (error != std::errc()) return false;
    at = next;
    skip_blanks();
    if (i + 1 < values.size() && (at == end || *at++ != ',')) return false;
  }
  return at == end;
}

}  // namespace

void read_csv(std::istream& in, const std::string& path, RecordSink& sink, LogHealth& health) {
  std::string line;
  bool complete = false;
  if (!next_line(in, line, complete)) {
    throw files::InputError(
        {path, "line 1", "", "", "the file is empty", "the recording failed; leave it out"});
  }
  if (!line.empty() && line[0] == '#') line.erase(0, 1);
  const std::vector<std::string> names = split(line);
  if (names.size() < 2 || line.size() > kLongestLine_bytes) {
    throw files::InputError({path, "line 1", "header", files::in_quotes(line), "does not name columns",
                             "the first line names them, separated by commas"});
  }
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size())
    throw files::InputError({path, "line 1", "header", "", "names a column twice", "rename one of them"});
  sink.begin(names);
  std::vector<double> values(names.size());
  while (next_line(in, line, complete)) {
    if (line.empty()) continue;
    if (parse_numbers(line, values)) {
      sink.record(values);
    } else if (complete) {
      ++health.damaged_lines;
    } else {
      health.truncated = true;
    }
  }
}

}  // namespace swarmcert::logs
