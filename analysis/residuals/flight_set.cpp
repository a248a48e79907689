#include "analysis/residuals/flight_set.h"

#include <fnmatch.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <tuple>

#include "analysis/logs/read_log.h"
#include "analysis/logs/vehicles_in_file.h"
#include "analysis/residuals/log_copies.h"
#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/toml.h"
#include "stability/model.h"

namespace swarmcert::residuals {
namespace {

namespace fs = std::filesystem;

struct LogName {
  std::string prefix, vehicle;
  int run;
  bool csv;
};

LogName parse_name(const std::string& name) {
  static const std::regex kPattern("(?:(.*)_)?(cf[0-9]{1,6})_([0-9]{1,6})([.]csv)?");
  std::smatch match;
  if (!std::regex_match(name, match, kPattern)) return {"", "", -1, false};
  return {match[1], match[2], std::stoi(match[3]), match[4].matched};
}

/// A log file and the names it belongs to.
struct FoundLog {
  std::string path, vehicle, flight, scenario, why;
  int run = 0;
  bool csv = false, position_only = false;
};

bool is_table(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".csv" || extension == ".CSV";
}

/// Returns true for logs. A CSV in a folder may be a trajectory or a table of results: it is a log if its header names
/// a time and a motion.
bool is_log(const std::string& file) {
  if (parse_name(fs::path(file).filename().string()).run >= 0) return true;
  if (!is_table(file)) return logs::looks_like_log(file);
  return logs::is_flight_table(file) || !logs::vehicles_in(file).empty();
}

struct Candidates {
  std::vector<std::string> logs, skipped;
};

std::string without_slash(const std::string& folder) {
  const fs::path path(folder);
  return path.has_filename() ? folder : path.parent_path().string();
}

Candidates candidates_below(const std::string& path) {
  if (!logs::address_of(path).vehicle.empty()) return {{path}, {}};
  if (!fs::exists(path))
    throw files::InputError({path, "", "", "", "does not exist", "name files or folders of flights"});
  if (!fs::is_directory(path)) {
    if (!is_table(path) && !is_log(path)) {
      throw files::InputError({path, "", "", "", "is not a flight log",
                               "'swarmcert inspect' reports what is in it; supported are micro-SD logs, PX4 "
                               "ULog, MCAP, rosbag2, ArduPilot and CSV"});
    }
    return {{path}, {}};
  }
  // A rosbag2 folder and a cfclient session are one log in several files.
  if (logs::looks_like_log(path)) return {{without_slash(path)}, {}};
  std::vector<std::string> files;
  Candidates found;
  for (fs::recursive_directory_iterator at(path), end; at != end; ++at) {
    const std::string entry = at->path().string();
    if (at->is_regular_file()) {
      files.push_back(entry);
    } else if (at->is_directory() && logs::looks_like_log(entry)) {
      at.disable_recursion_pending();
      found.logs.push_back(entry);
    }
  }
  std::sort(files.begin(), files.end());
  for (const std::string& file : files) (is_log(file) ? found.logs : found.skipped).push_back(file);
  std::sort(found.logs.begin(), found.logs.end());
  return found;
}

std::string folder_of(const std::string& file) {
  const fs::path folder = fs::absolute(file).lexically_normal().parent_path();
  return folder.filename().string();
}

/// Returns "E8" for "E8_log07"; the folder if the name does not start with a vehicle.
std::string vehicle_of(const std::string& file) {
  static const std::regex kPattern("([A-Za-z][A-Za-z0-9]*[0-9])[_-](?:log|flight|run|rep|trial)?[_-]?[0-9]+");
  std::smatch match;
  const std::string stem = fs::path(file).stem().string();
  return std::regex_match(stem, match, kPattern) ? match[1].str() : folder_of(file);
}

void fill_in(std::string& text, const std::string& file) {
  for (const auto& [word, value] : {std::pair<std::string, std::string>{"{folder}", folder_of(file)},
                                    {"{file}", fs::path(file).stem().string()}}) {
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + value.size()))
      text.replace(at, word.size(), value);
  }
}

FoundLog named(const std::string& file, const LogRule& rule) {
  FoundLog log;
  log.path = file;
  const LogName name = parse_name(fs::path(file).filename().string());
  log.scenario = folder_of(file);
  if (name.run >= 0) {
    if (!name.prefix.empty()) log.scenario += "/" + name.prefix;
    log.run = name.run;
    log.flight = log.scenario + "/" + (name.run < 10 ? "0" : "") + std::to_string(name.run);
    log.vehicle = name.vehicle;
    log.why = "named [<prefix>_]cf<id>_<run>";
  } else {
    log.flight = log.scenario + "/" + fs::path(file).stem().string();
    log.vehicle = vehicle_of(file);
    log.why = "one file";
  }
  const logs::LogAddress address = logs::address_of(file);
  if (!address.vehicle.empty()) {
    log.vehicle = address.vehicle;
    log.why = "one file of several vehicles";
  }
  log.csv = is_table(address.file);
  log.position_only = rule.use == LogRule::Use::kPosition;
  if (!rule.vehicle.empty()) log.vehicle = rule.vehicle;
  if (!rule.flight.empty()) {
    log.flight = rule.flight;
    log.why = "flights.toml";
  }
  return log;
}

/// Returns the overlap of two time spans divided by the shorter of them.
double overlap(Interval a, Interval b) {
  const double common = std::min(a.upper, b.upper) - std::max(a.lower, b.lower);
  return common / std::min(a.upper - a.lower, b.upper - b.lower);
}

/// Groups logs of one folder that were recorded at the same time on a common clock into one flight.
void group_by_clock(std::vector<FoundLog>& logs) {
  constexpr double kAbsolute_s = 1e8;
  std::map<fs::path, int> in_folder;
  for (const FoundLog& log : logs) ++in_folder[fs::path(log.path).parent_path()];
  struct Timed {
    std::size_t index;
    Interval span_s;
  };
  std::vector<Timed> timed;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    if (logs[i].why != "one file" || in_folder[fs::path(logs[i].path).parent_path()] < 2) continue;
    const Interval span_s = logs::time_span_s(logs[i].path);
    if (!(span_s.lower > kAbsolute_s) || !(span_s.upper > span_s.lower)) continue;
    for (const Timed& other : timed) {
      FoundLog& first = logs[other.index];
      if (fs::path(first.path).parent_path() != fs::path(logs[i].path).parent_path()) continue;
      if (!(overlap(other.span_s, span_s) > 0.5)) continue;
      for (FoundLog* const log : {&first, &logs[i]}) {
        log->vehicle = fs::path(log->path).stem().string();
        log->why = "absolute times overlap";
      }
      logs[i].flight = first.flight;
      break;
    }
    timed.push_back({i, span_s});
  }
}

}  // namespace

namespace {

/// Returns true if the last components of `path`, as many as `pattern` has, match it.
bool is_of(const std::string& pattern, const std::string& path) {
  const auto depth = std::count(pattern.begin(), pattern.end(), '/');
  fs::path tail;
  const fs::path full = fs::absolute(path).lexically_normal();
  auto part = full.end();
  for (std::ptrdiff_t k = 0; k <= depth && part != full.begin(); ++k)
    tail = tail.empty() ? *--part : *--part / tail;
  const std::string with = tail.string(), without = fs::path(tail).replace_extension().string();
  return fnmatch(pattern.c_str(), with.c_str(), 0) == 0 || fnmatch(pattern.c_str(), without.c_str(), 0) == 0;
}

}  // namespace

std::vector<std::string> patterns_without_log(const LogRules& rules, const FoundFlights& found) {
  std::vector<std::string> paths;
  for (const FlightFiles& flight : found.flights) {
    for (const auto& [vehicle, path] : flight.logs) paths.push_back(path);
  }
  for (const std::string& left_out : found.left_out)
    paths.push_back(left_out.substr(0, left_out.rfind(": ")));
  std::vector<std::string> patterns;
  for (const LogRule& rule : rules) {
    const auto matches = [&](const std::string& path) { return is_of(rule.pattern, path); };
    if (std::none_of(paths.begin(), paths.end(), matches)) patterns.push_back(rule.pattern);
  }
  return patterns;
}

LogRule rule_for(const LogRules& rules, const std::string& path) {
  std::vector<const LogRule*> matching;
  for (const LogRule& rule : rules) {
    if (is_of(rule.pattern, path)) matching.push_back(&rule);
  }
  const auto is_plain = [](const LogRule* rule) {
    return rule->pattern.find_first_of("*?[") == std::string::npos;
  };
  std::stable_sort(matching.begin(), matching.end(), [&](const LogRule* a, const LogRule* b) {
    if (is_plain(a) != is_plain(b)) return is_plain(a);
    return a->pattern.size() > b->pattern.size();
  });
  LogRule all;
  for (const LogRule* rule : matching) {
    if (all.vehicle.empty()) all.vehicle = rule->vehicle;
    if (all.flight.empty()) all.flight = rule->flight;
    if (all.model.empty()) all.model = rule->model;
    if (all.gains.empty()) all.gains = rule->gains;
    if (all.mass_kg == 0) all.mass_kg = rule->mass_kg;
    if (all.use == LogRule::Use::kUnsaid) all.use = rule->use;
  }
  fill_in(all.vehicle, path);
  fill_in(all.flight, path);
  return all;
}

FoundFlights find_flights(const std::vector<std::string>& paths, const LogRules& rules, bool by_columns) {
  FoundFlights result;
  std::vector<FoundLog> logs;
  std::set<std::string> seen;
  for (const std::string& path : paths) {
    const Candidates found = candidates_below(path);
    result.skipped.insert(result.skipped.end(), found.skipped.begin(), found.skipped.end());
    for (const std::string& file : found.logs) {
      for (const std::string& address : logs::addresses_in(file, by_columns)) {
        if (!seen.insert(address).second) continue;
        const LogRule rule = rule_for(rules, address);
        if (rule.use == LogRule::Use::kNone)
          result.left_out.push_back(address + ": excluded by flights.toml");
        else
          logs.push_back(named(address, rule));
      }
    }
  }
  group_by_clock(logs);
  // folder, scenario, run, name -> vehicle -> log; a CSV is used only without a binary log
  std::map<std::tuple<std::string, std::string, int, std::string>, std::map<std::string, FoundLog>> flights;
  for (FoundLog& log : logs) {
    const std::string folder = log.why == "flights.toml" ? "" : fs::path(log.path).parent_path().string();
    FoundLog& chosen = flights[{folder, log.scenario, log.run, log.flight}][log.vehicle];
    if (chosen.path.empty()) {
      chosen = log;
    } else if (log.csv == chosen.csv && log.why != "flights.toml") {
      result.skipped.push_back(log.path);
    } else if (log.why == "flights.toml") {
      throw files::InputError({log.path, "", "log.vehicle", log.vehicle,
                               "is the vehicle of " + chosen.path + " in the same flight, too",
                               "give the two logs different vehicles in flights.toml"});
    } else {
      result.skipped.push_back(log.csv ? log.path : chosen.path);
      if (!log.csv) chosen = log;
    }
  }
  for (const auto& [key, vehicles] : flights) {
    FlightFiles flight;
    const FoundLog& first = vehicles.begin()->second;
    flight.scenario = first.scenario;
    flight.run = first.run;
    flight.name = first.flight;
    flight.why = first.why;
    for (const auto& [vehicle, log] : vehicles) {
      flight.logs.emplace_back(vehicle, log.path);
      if (log.position_only) flight.position_only.insert(log.path);
    }
    result.flights.push_back(std::move(flight));
  }
  if (result.flights.empty()) {
    throw files::InputError({paths.empty() ? "" : paths[0], "", "", "", "there is no flight log here",
                             "'swarmcert inspect FILE' identifies a file"});
  }
  return result;
}

void leave_out_copies(FoundFlights& found) {
  LogCopies known;
  const auto is_copy = [&](const std::pair<std::string, std::string>& log) {
    const std::string file = logs::address_of(log.second).file, first = known.add(file);
    if (first.empty() || first == file) return false;
    if (found.copies.empty() || found.copies.back().first != file) found.copies.emplace_back(file, first);
    return true;
  };
  for (FlightFiles& flight : found.flights)
    flight.logs.erase(std::remove_if(flight.logs.begin(), flight.logs.end(), is_copy), flight.logs.end());
  found.flights.erase(std::remove_if(found.flights.begin(), found.flights.end(),
                                     [](const FlightFiles& flight) { return flight.logs.empty(); }),
                      found.flights.end());
}

std::vector<std::string> log_files(const FoundFlights& found) {
  std::vector<std::string> files;
  for (const FlightFiles& flight : found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      // The vehicles of one file follow one another.
      const std::string file = logs::address_of(path).file;
      if (files.empty() || files.back() != file) files.push_back(file);
    }
  }
  return files;
}

namespace {

constexpr const char* kFlightsSchema = "swarmcert/flights/1";
const std::vector<std::string> kUses = {"all", "position", "none"};

void describe_vehicle_use(files::Keys& keys) {
  keys.must<std::string>("model", "Its model.toml.");
  keys.may("use", "position: only as a neighbour.", "", files::OneOf{{kUses[0], kUses[1]}});
}

void describe_log_rule(files::Keys& keys) {
  keys.may<std::string>("vehicle", "That it is of.");
  keys.may<std::string>("flight", "That it belongs to.");
  keys.may<std::string>("model", "Its model.toml.");
  keys.may<std::string>("gains", "Its gains.toml.");
  keys.may<double>("mass_kg", "In place of the model's.", "kg");
  keys.may("use", "position: only as a neighbour.", "", files::OneOf{kUses});
}

}  // namespace

void describe_flights_file(files::Keys& keys) {
  keys.schema(kFlightsSchema);
  keys.may_named_tables("vehicle", "By name of a vehicle: its model and its use.", describe_vehicle_use);
  keys.may_named_tables("log", "By the name of a log, wildcards allowed.", describe_log_rule);
}

Fleet read_fleet(const std::string& path) {
  const toml::table document = files::parse_toml(files::read_file(path), path);
  const files::TomlTable root(document, path);
  root.choice("schema", {kFlightsSchema});
  root.allow_only(files::key_names(describe_flights_file));
  Fleet fleet;
  if (!root.has("vehicle")) return fleet;
  const files::TomlTable vehicles = root.table("vehicle");
  for (const std::string& name : vehicles.keys()) {
    const files::TomlTable table = vehicles.table(name);
    table.allow_only(files::key_names(describe_vehicle_use));
    VehicleUse use;
    use.model = (fs::path(path).parent_path() / table.text("model")).string();
    use.kind = stability::read_model(use.model).kind;
    if (table.has("use")) use.position_only = table.choice("use", {kUses[0], kUses[1]}) == 1;
    fleet[name] = use;
  }
  return fleet;
}

LogRules read_log_rules(const std::string& path) {
  const toml::table document = files::parse_toml(files::read_file(path), path);
  const files::TomlTable root(document, path);
  root.choice("schema", {kFlightsSchema});
  LogRules rules;
  if (!root.has("log")) return rules;
  const files::TomlTable logs = root.table("log");
  for (const std::string& pattern : logs.keys()) {
    const files::TomlTable table = logs.table(pattern);
    table.allow_only(files::key_names(describe_log_rule));
    LogRule rule;
    rule.pattern = pattern;
    const auto file = [&](const char* key) {
      return table.has(key) ? (fs::path(path).parent_path() / table.text(key)).string() : std::string();
    };
    if (table.has("vehicle")) rule.vehicle = table.text("vehicle");
    if (table.has("flight")) rule.flight = table.text("flight");
    rule.model = file("model");
    rule.gains = file("gains");
    if (table.has("mass_kg")) {
      rule.mass_kg = table.number("mass_kg");
      if (!(rule.mass_kg > 0)) table.refuse("mass_kg", std::to_string(rule.mass_kg), "must be positive");
    }
    if (table.has("use")) rule.use = static_cast<LogRule::Use>(1 + table.choice("use", kUses));
    rules.push_back(std::move(rule));
  }
  return rules;
}

}  // namespace swarmcert::residuals
