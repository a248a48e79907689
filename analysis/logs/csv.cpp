#include "nn/base/csv.h"

#include <algorithm>
#include <charconv>
#include <istream>
#include <limits>
#include <optional>
#include <set>

#include "analysis/logs/record_source.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kLongestLine_bytes = std::size_t{1} << 16;

/// Reads the next line without its line end; returns false at the end of the file. Overlong lines are truncated and
/// count as damage.
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

/// Consumes the number at the start of `text`.
template <typename Number>
bool take_number(std::string_view& text, Number& number) {
  const auto [next, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(next - text.data()));
  return true;
}
bool take(std::string_view& text, std::string_view any_of) {
  if (text.empty() || any_of.find(text[0]) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

/// Returns the days from 1970-01-01 to a Gregorian date. Years start in March so that the leap day comes last.
std::int64_t days_since_1970(std::int64_t year, int month, int day) {
  year -= month <= 2 ? 1 : 0;
  const std::int64_t march_based = (month + 9) % 12;
  return 365 * year + year / 4 - year / 100 + year / 400 + (153 * march_based + 2) / 5 + day - 719469;
}

/// Parses a time of day, "12:34:56.7", as seconds since midnight, and a date, "2026-03-02T12:34:56.7" with an optional
/// "Z" or "+01:00", as seconds since 1970.
std::optional<double> date_or_time_s(std::string_view text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, offset_hour = 0, offset_minute = 0;
  double second = 0, days_s = 0;
  std::string_view rest = text;
  if (take_number(rest, year) && take(rest, "-/")) {
    if (!take_number(rest, month) || !take(rest, "-/") || !take_number(rest, day) || !take(rest, "T _"))
      return std::nullopt;
    if (year < 1970 || year > 9999 || month < 1 || month > 12 || day < 1 || day > 31) return std::nullopt;
    days_s = 86400.0 * static_cast<double>(days_since_1970(year, month, day));
    text = rest;
  }
  if (!take_number(text, hour) || !take(text, ":") || !take_number(text, minute) || !take(text, ":") ||
      !take_number(text, second))
    return std::nullopt;
  const bool in_range = hour >= 0 && hour < 24 && minute >= 0 && minute < 60 && second >= 0 && second < 61;
  if (!in_range) return std::nullopt;
  if (text == "Z") text = {};
  if (!text.empty() && days_s > 0) {
    const double sign = text[0] == '-' ? -1 : 1;
    if (!take(text, "+-") || !take_number(text, offset_hour)) return std::nullopt;
    if (take(text, ":") && !take_number(text, offset_minute)) return std::nullopt;
    if (offset_hour > 14) offset_minute = offset_hour % 100, offset_hour /= 100;  // "+0130"
    days_s -= sign * (3600.0 * offset_hour + 60.0 * offset_minute);
  }
  return text.empty() ? std::optional(days_s + 3600.0 * hour + 60.0 * minute + second) : std::nullopt;
}

/// Parses the number of a cell, ignoring blanks and quotes around it; an empty cell gives NaN. Returns false for
/// anything else.
/// @param decimal_comma commas are decimal points
bool parse_cell(std::string_view cell, bool decimal_comma, double& value) {
  cell = files::without_blanks(cell);
  value = std::numeric_limits<double>::quiet_NaN();
  if (cell.empty()) return true;
  std::string_view digits = cell;
  if (digits[0] == '+') digits.remove_prefix(1);
  std::string pointed;
  if (decimal_comma && digits.find(',') != std::string_view::npos) {
    pointed = digits;
    std::replace(pointed.begin(), pointed.end(), ',', '.');
    digits = pointed;
  }
  double number = 0;
  if (take_number(digits, number) && digits.empty()) {
    value = number;
    return true;
  }
  const std::optional<double> time_s = date_or_time_s(cell);
  if (time_s) value = *time_s;
  return time_s.has_value();
}

/// A fault of a line that does not have exactly values.size() cells, each a number or empty where the sink needs it.
/// States the column of the offending cell, or none.
struct LineFault {
  std::size_t column;
  std::string_view cell;
};
std::optional<LineFault> parse_line(std::string_view line, char separator, const RecordSink& sink,
                                    std::vector<double>& values) {
  std::size_t at = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (separator == ' ') at = std::min(line.find_first_not_of(' ', at), line.size());
    const std::size_t end = std::min(line.find(separator, at), line.size());
    const std::string_view cell = line.substr(at, end - at);
    if (!parse_cell(cell, separator != ',', values[i]) && sink.needs(i)) return LineFault{i, cell};
    const bool last = i + 1 == values.size();
    if (last != (end == line.size())) return LineFault{values.size(), {}};
    at = end + 1;
  }
  return std::nullopt;
}

/// Returns `line` with the numbers of lists, "[0.1, 0.2]" with or without quotes, as cells of their own.
/// @param counts receives how many cells each cell of `line` has become
std::string without_lists(std::string_view line, char separator, std::vector<std::size_t>& counts) {
  constexpr std::string_view kOpen = "[(", kClose = "])", kBetween = "[]() ,;\t";
  counts.clear();
  std::string flat;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t first = line.find_first_not_of(" \"", at);
    const bool is_list = first < line.size() && kOpen.find(line[first]) != std::string_view::npos;
    std::size_t last = is_list ? first : at;
    for (int depth = 0; is_list && last < line.size(); ++last) {
      depth += kOpen.find(line[last]) != std::string_view::npos ? 1 : 0;
      depth -= kClose.find(line[last]) != std::string_view::npos ? 1 : 0;
      if (depth == 0) break;
    }
    const std::size_t end = std::min(line.find(separator, last), line.size());
    std::size_t count = 0;
    const auto add = [&](std::string_view cell) {
      if (!counts.empty() || count > 0) flat += separator;
      flat += cell;
      ++count;
    };
    for (std::size_t i = first; is_list && i < last;) {
      const std::size_t next = std::min(line.find_first_of(kBetween, i), last);
      if (next > i) add(line.substr(i, next - i));
      i = next + 1;
    }
    if (count == 0) add(line.substr(at, end - at));
    counts.push_back(count);
    at = end + 1;
  }
  return flat;
}

/// The line with the column names. Comment lines may precede it, and it may itself start with "#".
class Header {
 public:
  /// @return false if `in` has no header line
  bool read(std::istream& in) {
    std::string comment;
    bool complete = false;
    for (;;) {
      if (!next_line(in, line, complete)) return lines > 0;
      if (++lines == 1 && line.compare(0, 3, "\xEF\xBB\xBF") == 0) line.erase(0, 3);
      if (line.empty() || line[0] != '#') break;
      comment = line.substr(1);
    }
    double number = 0;
    const std::string_view first =
        std::string_view(line).substr(0, line.find(files::csv_separator(line, ' ')));
    if (comment.empty() || (!line.empty() && !parse_cell(first, false, number))) return true;
    if (complete || !line.empty()) first_record = line;
    line = comment;
    return true;
  }

  std::string line;
  std::optional<std::string> first_record;  ///< already read, after a header that is a comment
  std::size_t lines = 0;                    ///< lines read so far
};

}  // namespace

std::optional<files::InputFault> read_csv(std::istream& in, const std::string& path, RecordSink& sink,
                                          LogHealth& health) {
  Header header;
  if (!header.read(in)) {
    throw files::InputError(
        {path, "line 1", "", "", "the file is empty", "the recording failed; exclude this file"});
  }
  const std::string where = "line " + std::to_string(header.lines - (header.first_record ? 1 : 0));
  const char separator = files::csv_separator(header.line, ' ');
  const std::vector<std::string_view> cells = files::csv_cells(header.line, separator);
  std::vector<std::string> names(cells.begin(), cells.end());
  std::string line;
  bool complete = true, is_read = header.first_record.has_value();
  if (is_read)
    line = *header.first_record;
  else if ((is_read = next_line(in, line, complete)))
    ++header.lines;
  std::vector<std::size_t> counts;
  const bool has_lists = separator != ' ' && line.find_first_of("[(") != std::string::npos;
  if (has_lists) {
    line = without_lists(line, separator, counts);
    std::vector<std::string> flat;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::size_t count = i < counts.size() ? counts[i] : 1;
      for (std::size_t k = 0; k < count; ++k)
        flat.push_back(count == 1 ? names[i] : names[i] + '[' + std::to_string(k) + ']');
    }
    names = std::move(flat);
  }
  if (names.size() < 2 || header.line.size() > kLongestLine_bytes) {
    throw files::InputError({path, where, "header", files::in_quotes(header.line), "does not name columns",
                             "the first line names them, separated by commas, semicolons, tabs or blanks"});
  }
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size())
    throw files::InputError({path, where, "header", "", "names a column twice", "rename one of them"});
  sink.begin(names);
  std::vector<double> values(names.size());
  std::optional<files::InputFault> damage;
  std::size_t number = header.lines;
  const auto take_line = [&] {
    if (line.empty()) return;
    const std::optional<LineFault> fault = parse_line(line, separator, sink, values);
    if (!fault) {
      sink.record(values);
    } else if (!complete) {
      health.truncated = true;
    } else {
      ++health.damaged_lines;
      if (damage) return;
      const bool is_cell = fault->column < names.size();
      damage =
          files::InputFault{path,
                            "line " + std::to_string(number),
                            is_cell ? names[fault->column] : "cells",
                            is_cell ? files::in_quotes(std::string(fault->cell)) : "",
                            is_cell ? "is not a number" : "do not match the number of names in the header",
                            "times may be seconds, or dates like 2026-03-02T12:34:56.7; numbers have a "
                            "decimal point, or a decimal comma if commas do not separate cells"};
    }
  };
  if (is_read) take_line();
  while (next_line(in, line, complete)) {
    ++number;
    if (has_lists) line = without_lists(line, separator, counts);
    take_line();
  }
  return damage;
}

}  // namespace swarmcert::logs
