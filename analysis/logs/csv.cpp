#include "analysis/logs/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ctime>
#include <limits>
#include <set>

#include "analysis/logs/clock.h"
#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/recognition.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/csv.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kLongestHeader_bytes = std::size_t{1} << 16;

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
    std::tm date{};
    date.tm_year = year - 1900, date.tm_mon = month - 1, date.tm_mday = day;
    days_s = static_cast<double>(timegm(&date));
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
  std::string pointed(decimal_comma ? cell : "");
  std::replace(pointed.begin(), pointed.end(), ',', '.');
  if (files::csv_number(decimal_comma ? pointed : cell, value)) return true;
  value = date_or_time_s(cell).value_or(std::numeric_limits<double>::quiet_NaN());
  return std::isfinite(value);
}

/// A fault of a line that does not have exactly values.size() cells, each a number or empty where one is needed. States
/// the column of the offending cell, or none.
struct LineFault {
  std::size_t column;
  std::string_view cell;
};
std::optional<LineFault> parse_line(std::string_view line, char separator, const std::vector<char>& needs,
                                    std::vector<double>& values) {
  std::size_t at = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (separator == ' ') at = std::min(line.find_first_not_of(' ', at), line.size());
    const std::size_t end = std::min(line.find(separator, at), line.size());
    const std::string_view cell = line.substr(at, end - at);
    if (!parse_cell(cell, separator != ',', values[i]) && needs[i] != 0) return LineFault{i, cell};
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

/// Returns the names with those of lists repeated, name[0], name[1], ...
std::vector<std::string> with_elements(const std::vector<std::string>& names,
                                       const std::vector<std::size_t>& counts) {
  std::vector<std::string> flat;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::size_t count = i < counts.size() ? counts[i] : 1;
    for (std::size_t k = 0; k < count; ++k)
      flat.push_back(count == 1 ? names[i] : names[i] + '[' + std::to_string(k) + ']');
  }
  return flat;
}

/// Adds the nanoseconds that stand in the column after whole seconds to these: they rise within each second.
void join_nanoseconds(RawTopic& topic) {
  const auto are_whole = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double x) { return x == std::floor(x); });
  };
  for (std::size_t c = 0; c + 1 < topic.columns.size(); ++c) {
    std::vector<double>& seconds = topic.columns[c].values;
    const std::vector<double>& more = topic.columns[c + 1].values;
    if (!are_whole(seconds) || !are_whole(more) || std::is_sorted(more.begin(), more.end())) continue;
    std::vector<double> joined = seconds;
    std::size_t same = 0;
    for (std::size_t i = 0; i < joined.size(); ++i) {
      joined[i] += 1e-9 * more[i];
      same += i > 0 && seconds[i] == seconds[i - 1] ? 1 : 0;
    }
    const double least = quantile_of(more, 0), most = quantile_of(more, 1);
    const bool is_clock = least >= 0 && most > 1e6 && most < 1e9 && 2 * same > seconds.size();
    if (is_clock && std::is_sorted(joined.begin(), joined.end())) seconds = std::move(joined);
  }
}

/// Begins the topic of a table; returns which columns must hold numbers.
std::vector<char> begin_topic(RawLog& log, const std::vector<std::string>& names, const SignalMap& map,
                              std::optional<Clock>& clock) {
  log.topics.emplace_back();
  for (const std::string& name : names) log.topics.back().columns.push_back({name, {}});
  clock = stated_clock(log, map);
  std::vector<char> needs(names.size(), 0);
  if (clock) needs[clock->column] = 1;
  for (const Carried& carried : recognise(log, map).groups)
    for (const int column : carried.columns)
      if (column >= 0) needs[static_cast<std::size_t>(column)] = 1;
  return needs;
}

files::InputFault damage_of(const LineFault& fault, const std::vector<std::string>& names,
                            const std::string& path, std::size_t line) {
  const bool is_cell = fault.column < names.size();
  return {path,
          "line " + std::to_string(line),
          is_cell ? names[fault.column] : "cells",
          is_cell ? files::in_quotes(std::string(fault.cell)) : "",
          is_cell ? "is not a number" : "do not match the number of names in the header",
          "times may be seconds, or dates like 2026-03-02T12:34:56.7; numbers have a "
          "decimal point, or a decimal comma if commas do not separate cells"};
}

}  // namespace

std::string_view take_text_line(std::string_view text, std::size_t& at) {
  if (at >= text.size()) return {};
  const std::size_t end = std::min(text.find('\n', at), text.size());
  std::string_view line = text.substr(at, end - at);
  at = end + 1;
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::optional<TableHeader> header_of(std::string_view text, char otherwise) {
  TableHeader header;
  std::string_view line, comment;
  std::size_t at = text.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0, comment_at = at;
  do {
    if (at >= text.size()) return std::nullopt;
    if (!line.empty()) comment = line.substr(1), comment_at = header.begin;
    header.begin = at;
    line = take_text_line(text, at);
    ++header.line;
  } while (!line.empty() && line[0] == '#');
  header.end = std::min(at, text.size());
  double number = 0;
  const std::string_view first = line.substr(0, line.find(files::csv_separator(line, ' ')));
  const auto cells_in = [otherwise](std::string_view row) {
    return files::csv_cells(row, files::csv_separator(row, otherwise)).size();
  };
  if (!comment.empty() &&
      (line.empty() || (parse_cell(first, false, number) && cells_in(comment) >= cells_in(line)))) {
    header.end = header.begin;
    header.begin = comment_at;
    --header.line;
    line = comment;
  }
  header.separator = files::csv_separator(line, otherwise);
  header.names = files::csv_cells(line, header.separator);
  return header;
}

RawLog read_table(std::istream& in, const std::string& path, const SignalMap& map) {
  RawLog log;
  log.path = path;
  log.format = "csv";
  const std::string text = read_all(in, path);
  const std::optional<TableHeader> header = header_of(text, ' ');
  std::vector<std::string> names;
  if (header) names.assign(header->names.begin(), header->names.end());
  const std::string where = "line " + std::to_string(header ? header->line : 1);
  std::size_t at = header ? header->end : 0, number = header ? header->line : 0;
  double first_number = 0;
  const bool is_record =
      !names.empty() && !names[0].empty() && parse_cell(names[0], header->separator != ',', first_number);
  if (is_record) {  // there is no header
    for (std::size_t i = 0; i < names.size(); ++i) names[i] = "column " + std::to_string(i + 1);
    at = header->begin;
    --number;
  }
  std::size_t first = at;
  std::vector<std::size_t> counts;
  const std::string_view second = take_text_line(text, first);
  const bool has_lists =
      header && header->separator != ' ' && second.find_first_of("[(") != std::string_view::npos;
  if (has_lists) {
    without_lists(second, header->separator, counts);
    names = with_elements(names, counts);
  }
  if (names.size() < 2 || header->end - header->begin > kLongestHeader_bytes) {
    const std::string stated = header ? text.substr(header->begin, header->end - header->begin) : "";
    throw files::InputError({path, where, "header", files::in_quotes(stated), "does not name columns",
                             "the first line names them, separated by commas, semicolons, tabs or blanks"});
  }
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size())
    throw files::InputError({path, where, "header", "", "names a column twice", "rename one of them"});
  std::optional<Clock> clock;
  const std::vector<char> needs = begin_topic(log, names, map, clock);
  std::vector<double> values(names.size());
  std::optional<files::InputFault> damage;
  std::string flat;
  while (at < text.size()) {
    std::string_view line = take_text_line(text, at);
    ++number;
    if (line.empty()) continue;
    if (has_lists) line = flat = without_lists(line, header->separator, counts);
    const std::optional<LineFault> fault = parse_line(line, header->separator, needs, values);
    if (!fault) {
      for (std::size_t c = 0; c < values.size(); ++c) log.topics[0].columns[c].values.push_back(values[c]);
    } else if (at > text.size()) {
      log.health.truncated = true;
    } else {
      ++log.health.damaged_lines;
      if (!damage) damage = damage_of(*fault, names, path, number);
    }
  }
  join_nanoseconds(log.topics[0]);
  set_times(log, clock);
  log.health.records = log.topics.front().time_s.size();
  if (damage && log.health.records == 0) throw files::InputError(*damage);
  return log;
}

}  // namespace swarmcert::logs
