#include "analysis/report/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace swarmcert::analysis {
namespace {

using files::Node;

/// Returns the name of a field without the unit at its end: "smallest_height_m" in metres is "smallest height".
std::string words_of(const Node& field) {
  std::string suffix = "_";
  for (const char c : std::string(field.about.unit)) suffix += c == '/' || c == ' ' ? '_' : c;
  suffix.erase(std::remove(suffix.begin(), suffix.end(), '^'), suffix.end());
  std::string words = field.name;
  if (suffix.size() > 1 && words.size() > suffix.size() &&
      words.compare(words.size() - suffix.size(), suffix.size(), suffix) == 0)
    words.resize(words.size() - suffix.size());
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

/// The innermost unit on the way to `path`: the axes of a vector have the unit of the vector.
std::string unit_at(const Node& row, const std::string& path) {
  std::string unit;
  for (std::size_t dot = 0; dot != path.npos;) {
    dot = path.find('.', dot + 1);
    const Node* const at = row.find(path.substr(0, dot));
    if (at != nullptr && *at->about.unit != '\0') unit = at->about.unit;
  }
  return unit;
}

/// Factor and name of the unit in which a column shows the field at its path.
std::pair<double, std::string> scale_of(const Column& column, const std::string& path, const Node& row,
                                        const ForceScale& forces) {
  if (*column.unit != '\0' || column.factor != 1) return {column.factor, column.unit};
  return shown_unit(unit_at(row, path), forces);
}

std::string head_of(const Column& column, const std::string& path, const Node& row, const std::string& unit) {
  std::string words = column.head;
  if (words.empty() && !path.empty()) words = words_of(*row.find(path));
  return unit.empty() ? words : words + " [" + unit + "]";
}

/// The first row that has a field; nullptr: none.
const Node* row_with(const Node& list, const std::string& path) {
  for (const Node& row : list.members)
    if (path.empty() || row.find(path) != nullptr) return &row;
  return nullptr;
}

bool is_numeric(const std::string& text) {
  return !text.empty() && (std::isdigit(static_cast<unsigned char>(text.back())) != 0 || text == "-");
}

/// Number of characters, not of bytes, of a UTF-8 text.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

}  // namespace

std::pair<double, std::string> shown_unit(const std::string& unit, const ForceScale& forces) {
  if (unit == "N") return {1 / forces.size_N, forces.unit};
  if (unit == "N/s" || unit == "N s") return {1 / forces.size_N, forces.unit + unit.substr(1)};
  return {1, unit};
}

std::string cell(const Node& value, const char* format, double factor) {
  if (const bool* flag = std::get_if<bool>(&value.value)) return *flag ? "yes" : "no";
  if (const double* number = std::get_if<double>(&value.value))
    return std::isfinite(*number)
               ? fmt::format(fmt::runtime(*format != '\0' ? format : "{:.4g}"), *number * factor)
               : "-";
  if (const auto* integer = std::get_if<std::int64_t>(&value.value)) return std::to_string(*integer);
  if (const auto* integer = std::get_if<std::uint64_t>(&value.value)) return std::to_string(*integer);
  if (const std::string* text = std::get_if<std::string>(&value.value)) return *text;
  std::string words;
  for (const Node& member : value.members)
    words += (words.empty() ? "" : ", ") + (value.kind == Node::Kind::kMap ? member.name + " " : "") +
             cell(member, format, factor);
  return words.empty() ? "-" : words;
}

Table table(const Node& list, const std::vector<Column>& columns, const ForceScale& forces) {
  Table result;
  if (list.members.empty()) return result;
  struct Shown {
    std::string path;
    const char* format;
    double factor;
  };
  std::vector<Shown> shown;
  for (const Column& column : columns) {
    std::string path = column.path;
    const bool may_lack = !path.empty() && path.back() == '?';
    if (may_lack) path.pop_back();
    const Node* const row = row_with(list, path);
    if (row == nullptr && may_lack) continue;
    if (row == nullptr) throw std::logic_error("no row has a field " + path);
    const auto [factor, unit] = scale_of(column, path, *row, forces);
    shown.push_back({path, column.format, factor});
    result.header.push_back(head_of(column, path, *row, unit));
  }
  for (const Node& row : list.members) {
    std::vector<std::string> cells;
    for (const Shown& column : shown) {
      const Node* const field = column.path.empty() ? nullptr : row.find(column.path);
      cells.push_back(column.path.empty() ? row.name
                      : field == nullptr  ? "-"
                                          : cell(*field, column.format, column.factor));
    }
    result.rows.push_back(std::move(cells));
  }
  return result;
}

Table fields_table(const Node& record, const std::vector<Column>& rows, const ForceScale& forces) {
  Table result;
  for (const Column& row : rows) {
    const Node* const field = record.find(row.path);
    if (field == nullptr) continue;
    const auto [factor, unit] = scale_of(row, row.path, record, forces);
    const std::string value = cell(*field, row.format, factor);
    result.rows.push_back(
        {*row.head != '\0' ? row.head : words_of(*field), unit.empty() ? value : value + " " + unit});
  }
  return result;
}

std::string to_text(const Table& table) {
  std::vector<std::vector<std::string>> lines = table.rows;
  if (!table.header.empty()) lines.insert(lines.begin(), table.header);
  std::vector<std::size_t> widths;
  std::vector<bool> is_right;
  for (const auto& line : lines) {
    widths.resize(std::max(widths.size(), line.size()));
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], width_of(line[i]));
  }
  for (std::size_t i = 0; i < widths.size(); ++i)
    is_right.push_back(std::all_of(table.rows.begin(), table.rows.end(),
                                   [i](const auto& row) { return i >= row.size() || is_numeric(row[i]); }));
  std::string text;
  for (const auto& line : lines) {
    std::string row = " ";
    for (std::size_t i = 0; i < line.size(); ++i) {
      const std::string padding(widths[i] - width_of(line[i]), ' ');
      row += (i == 0 ? " " : "  ") + (is_right[i] ? padding + line[i] : line[i] + padding);
    }
    text += row.substr(0, row.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

}  // namespace swarmcert::analysis
