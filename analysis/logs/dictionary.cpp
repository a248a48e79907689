#include "analysis/logs/dictionary.h"

#include <algorithm>
#include <map>

#include "nn/base/text.h"

namespace swarmcert::logs {
namespace {

using files::TomlTable;

/// Calls `use` with the program, its file and each table of the list `key` in it.
template <typename Use>
void for_each_table(const std::string& key, const Use& use) {
  for (const auto& [file, text] : dictionary_files()) {
    if (!files::ends_with(file, ".toml") || !dictionary_table(file).has(key)) continue;
    const TomlTable root = dictionary_table(file);
    for (const TomlTable& table : root.tables(key)) use(file.substr(0, file.find('.')), root, table);
  }
}

std::string text_or(const TomlTable& table, const std::string& key, const std::string& otherwise = "") {
  return table.has(key) ? table.text(key) : otherwise;
}
std::vector<std::string> texts_or(const TomlTable& table, const std::string& key,
                                  const std::vector<std::string>& otherwise = {}) {
  return table.has(key) ? table.texts(key) : otherwise;
}

std::vector<Unit> units_named(const std::string& name) {
  std::vector<Unit> units;
  for (const TomlTable& table : dictionary_table("signals.toml").tables("units")) {
    if (table.text("of") != name) continue;
    const std::vector<std::string> names = table.texts("names");
    const std::vector<std::vector<double>> factors = table.rows("factors");
    for (const double sign : {1.0, -1.0})
      for (std::size_t i = 0; i < names.size() && (sign > 0 || table.has("both_signs")); ++i)
        units.push_back(
            {(sign < 0 ? "-" : "") + names[i],
             {sign * factors.at(i).at(0), factors[i].at(1), factors[i].size() > 2 ? factors[i][2] : 0}});
  }
  return units;
}

/// Adds one row for each pattern of `table`, with '#' replaced by the parts of the signal.
void add_rows(const std::string& program, const TomlTable& file, const TomlTable& table,
              std::vector<NamedColumns>& rows) {
  static const std::vector<std::string> origins = {
      "own", "program", "message", "as it is", "beside the program's names", "in its message"};
  const auto kind = std::find_if(signal_kinds().begin(), signal_kinds().end(),
                                 [&](const SignalKind& one) { return one.name == table.text("signal"); });
  if (kind == signal_kinds().end()) table.refuse("signal", table.text("signal"), "is not in signals.toml");
  NamedColumns row;
  row.signal = kind->first;
  row.unit = table.text("unit");
  const std::optional<UnitFactor> factor = unit_factor(row.signal, row.unit);
  if (!factor) table.refuse("unit", row.unit, "is no unit of the signal");
  row.factor = *factor;
  if (table.has("open"))
    row.ask = table.choice("open", {"request or duty", "frame"}) == 0 ? Ask::kMotors : Ask::kVelocityFrame;
  row.origin = static_cast<Origin>((table.has("found") ? table : file).choice("found", origins));
  if (file.has("frame") && kind->columns.size() == 3) row.sign = {1, -1, -1, 1};
  const std::vector<double> sign = table.has("sign") ? table.numbers("sign") : std::vector<double>();
  std::copy(sign.begin(), sign.end(), row.sign.begin());
  row.program = program;
  row.message = text_or(table, "message");
  row.instead_of = text_or(table, "instead_of");
  row.functions = text_or(table, "functions");
  row.first_function = table.has("first_function") ? static_cast<int>(table.number("first_function")) : 0;
  row.limits = texts_or(table, "limits");
  for (const std::string& pattern :
       table.is_list("names") ? table.texts("names") : std::vector{table.text("names")}) {
    // "[#]" counts from 0.
    const std::size_t at = pattern.find('#'), index = pattern.find("[#]");
    std::vector<std::string> parts;
    for (const std::string& column : kind->columns)
      parts.push_back(index != std::string::npos ? std::to_string(parts.size())
                                                 : column.substr(column.rfind('_') + 1));
    row.names.clear();
    for (const std::string& part : texts_or(table, "parts", parts))
      row.names.push_back(at == std::string::npos ? pattern : std::string(pattern).replace(at, 1, part));
    if (at == std::string::npos) row.names.resize(1);
    rows.push_back(row);
  }
}

std::vector<Sign> signs_called(const std::string& key) {
  std::vector<Sign> signs;
  for_each_table(key, [&](const std::string&, const TomlTable&, const TomlTable& table) {
    const std::vector<double> range = table.has("range") ? table.numbers("range") : std::vector<double>{0, 0};
    signs.push_back({text_or(table, "message"), text_or(table, "column"), text_or(table, "parameter"),
                     text_or(table, "text"), range.at(0), range.at(1), table.text("means"),
                     texts_or(table, "of")});
  });
  return signs;
}

}  // namespace

const std::string& dictionary_text(const std::string& file) {
  const auto& all = dictionary_files();
  return std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.first == file; })->second;
}

TomlTable dictionary_table(const std::string& file) {
  static const std::map<std::string, toml::table> tables = [] {
    std::map<std::string, toml::table> all;
    for (const auto& [name, text] : dictionary_files())
      if (files::ends_with(name, ".toml")) all.emplace(name, files::parse_toml(text, "dictionary/" + name));
    return all;
  }();
  return {tables.at(file), "dictionary/" + file};
}

const std::vector<std::string>& words_of_kind(const std::string& kind) {
  static const std::map<std::string, std::vector<std::string>> words = [] {
    std::map<std::string, std::vector<std::string>> all;
    const TomlTable table = dictionary_table("words.toml").table("words");
    for (const std::string& key : table.keys()) all[key] = table.texts(key);
    return all;
  }();
  return words.at(kind);
}

bool is_word_of(const std::string& kind, const std::string& word) {
  const std::vector<std::string>& words = words_of_kind(kind);
  return std::find(words.begin(), words.end(), word) != words.end();
}

const std::vector<SignalKind>& signal_kinds() {
  static const std::vector<SignalKind> kinds = [] {
    std::vector<SignalKind> all;
    int first = 0;
    for (const TomlTable& table : dictionary_table("signals.toml").tables("signal")) {
      all.push_back({first, table.text("name"), table.texts("columns"), units_named(table.text("units")),
                     texts_or(table, "frames"), table.has("command"), table.has("partial")});
      first += static_cast<int>(all.back().columns.size());
    }
    return all;
  }();
  return kinds;
}

const SignalKind& kind_of_signal(int signal) {
  return *std::find_if(signal_kinds().rbegin(), signal_kinds().rend(),
                       [&](const SignalKind& kind) { return kind.first <= signal; });
}

const std::vector<NamedColumns>& column_names() {
  static const std::vector<NamedColumns> rows = [] {
    std::vector<NamedColumns> all;
    for_each_table("columns", [&](const auto&... parts) { add_rows(parts..., all); });
    return all;
  }();
  return rows;
}

const std::vector<Sign>& signs_of_state() {
  static const std::vector<Sign> signs = signs_called("signs");
  return signs;
}
const std::vector<Sign>& signs_of_vehicle() {
  static const std::vector<Sign> signs = signs_called("vehicles");
  return signs;
}

std::string line_that_logs(const std::string& program, const std::string& signal) {
  const TomlTable lines = dictionary_table(program + ".toml").table("log_this");
  return lines.text("where") + lines.text(signal);
}

}  // namespace swarmcert::logs
