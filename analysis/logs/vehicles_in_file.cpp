#include "analysis/logs/vehicles_in_file.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string_view>

#include "analysis/logs/clock.h"
#include "analysis/logs/column_names.h"
#include "analysis/logs/csv.h"
#include "analysis/logs/dictionary.h"
#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/recognition.h"
#include "nn/base/csv.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/text.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kMostVehicles = 64;
constexpr std::size_t kFewestRows = 10;

/// Returns the words of `name` in lower case without what separates them: "Drone ID" becomes "droneid".
std::string joined_words(std::string_view name) {
  std::string joined = plain_name(std::string(name));
  joined.erase(std::remove(joined.begin(), joined.end(), '.'), joined.end());
  return joined;
}

bool names_crazyflies(std::string_view column) {
  const std::string name = joined_words(column);
  return name.rfind("cf", 0) == 0 || name.rfind("crazyflie", 0) == 0;
}

bool may_name_vehicles(std::string_view column) {
  const std::string name = joined_words(column);
  if (name == "id" || name == "name" || is_word_of("vehicle", name)) return true;
  for (const std::string_view ending : {"id", "name", "number"}) {
    if (files::ends_with(name, ending) && is_word_of("vehicle", name.substr(0, name.size() - ending.size())))
      return true;
  }
  return false;
}

/// Returns a name that can stand in addresses and file names.
std::string vehicle_name(std::string_view entry, std::string_view column) {
  std::string name;
  for (const char c : entry)
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' ? c : '_';
  double number = 0;
  if (files::csv_number(entry, number)) name = (names_crazyflies(column) ? "cf" : "vehicle") + name;
  return name;
}

RawTopic topic_with(const std::vector<std::string_view>& names) {
  RawTopic topic;
  for (const std::string_view name : names) topic.columns.push_back({std::string(name), {}});
  return topic;
}

std::string_view cell_of(std::string_view line, char separator, std::size_t column) {
  const std::vector<std::string_view> cells = files::csv_cells(line, separator);
  return column < cells.size() ? cells[column] : std::string_view();
}

/// Returns whether time `a` is before `b`; dates of one form are ordered as their texts are.
bool is_before(std::string_view a, std::string_view b) {
  double first = 0, second = 0;
  if (files::csv_number(a, first) && files::csv_number(b, second)) return first < second;
  return a < b;
}

/// The rows with one entry in the column that may name vehicles.
struct EntryRows {
  std::string_view first, last;  ///< times
  std::size_t rows = 0, descents = 0;
};

/// A column that names the vehicle of each row.
struct VehicleColumn {
  std::size_t column = 0;
  std::map<std::string, std::string> entries;  ///< by name of the vehicle
};

std::optional<VehicleColumn> vehicle_column(std::string_view text, const TableHeader& header) {
  const int clock = clock_by_name(topic_with(header.names));
  if (clock < 0) return std::nullopt;
  for (std::size_t column = 0; column < header.names.size(); ++column) {
    if (static_cast<int>(column) == clock || !may_name_vehicles(header.names[column])) continue;
    std::map<std::string_view, EntryRows> all;
    for (std::size_t at = header.end; at < text.size() && all.size() <= kMostVehicles;) {
      const std::string_view line = take_text_line(text, at);
      const std::string_view entry = cell_of(line, header.separator, column);
      const std::string_view time = cell_of(line, header.separator, static_cast<std::size_t>(clock));
      if (entry.empty() || time.empty()) continue;
      EntryRows& rows = all[entry];
      if (rows.rows++ == 0)
        rows.first = time;
      else if (!is_before(rows.last, time))
        ++rows.descents;
      rows.last = time;
    }
    if (all.size() < 2 || all.size() > kMostVehicles) continue;
    const bool are_vehicles = std::all_of(all.begin(), all.end(), [&](const auto& one) {
      const EntryRows& own = one.second;
      return own.rows >= kFewestRows && 10 * own.descents < own.rows &&
             std::any_of(all.begin(), all.end(), [&](const auto& other) {
               return &other != &one && is_before(own.first, other.second.last) &&
                      is_before(other.second.first, own.last);
             });
    });
    if (!are_vehicles) continue;
    VehicleColumn found;
    found.column = column;
    for (const auto& [entry, rows] : all)
      found.entries[vehicle_name(entry, header.names[column])] = std::string(entry);
    if (found.entries.size() == all.size()) return found;
  }
  return std::nullopt;
}

/// The columns of each vehicle, by its name: index and name without the vehicle.
using VehicleColumns = std::map<std::string, std::map<std::size_t, std::string>>;

/// Returns the columns whose names begin with a vehicle and its number, if those of each vehicle are called alike and
/// give its position or velocity: the columns of motors 1 to 4 do not.
VehicleColumns prefixed_columns(const TableHeader& header) {
  static const std::regex kPrefixed("([A-Za-z][A-Za-z_]*[0-9]{1,6})[._/: ]+([^._/: ].*)");
  std::map<std::string, VehicleColumns> by_stem;
  for (std::size_t i = 0; i < header.names.size(); ++i) {
    std::match_results<std::string_view::const_iterator> match;
    if (!std::regex_match(header.names[i].begin(), header.names[i].end(), match, kPrefixed)) continue;
    const std::string vehicle = match[1];
    by_stem[vehicle.substr(0, vehicle.find_first_of("0123456789"))][vehicle][i] = match[2];
  }
  for (const auto& [stem, vehicles] : by_stem) {
    if (vehicles.size() < 2 || vehicles.size() > kMostVehicles) continue;
    std::set<std::set<std::string>> called;
    for (const auto& [vehicle, columns] : vehicles) {
      std::set<std::string> names;
      for (const auto& [index, name] : columns) names.insert(name);
      called.insert(names);
    }
    if (called.size() != 1) continue;
    RawLog log;
    log.topics.emplace_back();
    for (const std::string& name : *called.begin()) log.topics[0].columns.push_back({name, {}});
    const Recognition found = recognise(log, {});
    if (found.find(kPosition) != nullptr || found.find(kVelocity) != nullptr) return vehicles;
  }
  return {};
}

bool may_hold_several(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  return (extension == ".csv" || extension == ".CSV") && std::filesystem::is_regular_file(path) &&
         format_of(head_of_file(path)) == nullptr;
}

std::string rows_of_vehicle(std::string_view text, const TableHeader& header, const VehicleColumn& by,
                            const std::string& vehicle) {
  std::string rows(text.substr(0, header.end));
  const auto entry = by.entries.find(vehicle);
  if (entry == by.entries.end()) return {};
  for (std::size_t at = header.end; at < text.size();) {
    const std::size_t begin = at;
    const std::string_view line = take_text_line(text, at);
    if (cell_of(line, header.separator, by.column) == entry->second)
      rows += text.substr(begin, std::min(at, text.size()) - begin);
    else
      rows += '\n';
  }
  return rows;
}

/// Returns the columns of `vehicle` without its name, and those that no vehicle has to itself.
std::string columns_of_vehicle(std::string_view text, const TableHeader& header, const VehicleColumns& all,
                               const std::string& vehicle) {
  const auto own = all.find(vehicle);
  if (own == all.end()) return {};
  std::set<std::string> own_names;
  for (const auto& [index, name] : own->second) own_names.insert(name);
  std::vector<std::size_t> kept;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < header.names.size(); ++i) {
    const auto column = own->second.find(i);
    const bool is_of_other = std::any_of(all.begin(), all.end(), [&](const auto& one) {
      return one.first != vehicle && one.second.count(i) != 0;
    });
    if (is_of_other || (column == own->second.end() && own_names.count(std::string(header.names[i])) != 0))
      continue;
    kept.push_back(i);
    names.push_back(column == own->second.end() ? std::string(header.names[i]) : column->second);
  }
  std::string table(text.substr(0, header.begin));
  const std::string separator(1, header.separator);
  table += fmt::format("{}{}\n", text[header.begin] == '#' ? "#" : "", fmt::join(names, separator));
  for (std::size_t at = header.end; at < text.size();) {
    const std::string_view line = take_text_line(text, at);
    std::vector<std::string_view> cells;
    if (!line.empty()) cells = files::csv_cells(line, header.separator);
    if (cells.size() != header.names.size()) {
      table += line;  // damaged: the reader counts it
    } else {
      for (std::size_t k = 0; k < kept.size(); ++k) {
        if (k > 0) table += header.separator;
        table += cells[kept[k]];
      }
    }
    if (at <= text.size()) table += '\n';
  }
  return table;
}

/// The vehicles of a table, by columns or by rows.
struct Vehicles {
  TableHeader header;
  VehicleColumns columns;
  VehicleColumn rows;
};
Vehicles vehicles_of(std::string_view text, bool by_columns) {
  Vehicles found;
  const std::optional<TableHeader> header = header_of(text, ',');
  if (!header) return found;
  found.header = *header;
  if (by_columns) found.columns = prefixed_columns(*header);
  if (found.columns.empty()) found.rows = vehicle_column(text, *header).value_or(VehicleColumn());
  return found;
}

}  // namespace

LogAddress address_of(const std::string& path) {
  std::error_code ignored;
  const std::size_t mark = path.rfind('#');
  if (mark == std::string::npos || mark == 0 || mark + 1 == path.size() ||
      std::filesystem::exists(path, ignored) ||
      !std::filesystem::is_regular_file(path.substr(0, mark), ignored))
    return {path, ""};
  return {path.substr(0, mark), path.substr(mark + 1)};
}

std::vector<std::string> vehicles_in(const std::string& path, bool by_columns) {
  std::vector<std::string> names;
  if (!may_hold_several(path)) return names;
  try {
    const std::string text = files::read_file(path, kLargestLog_bytes);
    const Vehicles found = vehicles_of(text, by_columns);
    for (const auto& [vehicle, columns] : found.columns) names.push_back(vehicle);
    for (const auto& [vehicle, entry] : found.rows.entries) names.push_back(vehicle);
  } catch (const files::InputError&) {
    return {};
  }
  return names;
}

std::vector<std::string> addresses_in(const std::string& path, bool by_columns) {
  std::vector<std::string> addresses;
  for (const std::string& vehicle : vehicles_in(path, by_columns)) addresses.push_back(path + "#" + vehicle);
  if (addresses.empty()) addresses.push_back(path);
  return addresses;
}

std::string table_of(const LogAddress& address) {
  std::string table;
  const std::string text = files::read_file(address.file, kLargestLog_bytes);
  if (may_hold_several(address.file)) {
    const Vehicles found = vehicles_of(text, true);
    table = found.columns.empty() ? rows_of_vehicle(text, found.header, found.rows, address.vehicle)
                                  : columns_of_vehicle(text, found.header, found.columns, address.vehicle);
  }
  if (table.empty()) {
    const std::vector<std::string> vehicles = vehicles_in(address.file);
    throw files::InputError(
        {address.file, "", "vehicle", address.vehicle, "is not a vehicle of this file",
         vehicles.empty() ? "the file holds the log of one vehicle: leave out '#" + address.vehicle + "'"
                          : fmt::format("its vehicles are {}", fmt::join(vehicles, ", "))});
  }
  return table;
}

void refuse_several_vehicles(const std::string& path, bool by_columns) {
  const std::vector<std::string> vehicles = vehicles_in(path, by_columns);
  if (vehicles.empty()) return;
  throw files::InputError(
      {path, "", "", "", fmt::format("holds the logs of {} vehicles", vehicles.size()),
       fmt::format("read one of them: {}", fmt::join(addresses_in(path, by_columns), ", "))});
}

}  // namespace swarmcert::logs
