#include "analysis/residuals/flight_set.h"

#include <algorithm>
#include <filesystem>
#include <regex>
#include <tuple>

#include "analysis/logs/read_log.h"
#include "nn/base/file_io.h"
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

std::vector<std::string> files_below(const std::string& path) {
  if (!fs::exists(path))
    throw files::InputError({path, "", "", "", "does not exist", "name files or folders of flights"});
  if (!fs::is_directory(path)) {
    if (parse_name(fs::path(path).filename().string()).run < 0) {
      throw files::InputError({path, "", "", "", "is not named like a log",
                               "rename it to [<prefix>_]cf<id>_<run> or the same with .csv"});
    }
    return {path};
  }
  std::vector<std::string> found;
  for (const auto& entry : fs::recursive_directory_iterator(path)) {
    if (entry.is_regular_file()) found.push_back(entry.path().string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

FoundFlights find_flights(const std::vector<std::string>& paths) {
  FoundFlights result;
  // folder, prefix, run -> vehicle -> path; a CSV only where there is no binary log
  std::map<std::tuple<std::string, std::string, int>, std::map<std::string, std::string>> flights;
  for (const std::string& path : paths) {
    for (const std::string& file : files_below(path)) {
      const LogName name = parse_name(fs::path(file).filename().string());
      if (name.run < 0) {
        result.skipped.push_back(file);
        continue;
      }
      fs::path folder_path = fs::path(file).parent_path();
      if (folder_path.empty()) folder_path = ".";
      const std::string folder = folder_path.string();
      std::string& chosen = flights[{folder, name.prefix, name.run}][name.vehicle];
      if (chosen == file) continue;
      if (chosen.empty()) {
        chosen = file;
      } else if (name.csv) {
        result.skipped.push_back(file);
      } else {
        result.skipped.push_back(chosen);
        chosen = file;
      }
    }
  }
  for (const auto& [key, vehicles] : flights) {
    const auto& [folder, prefix, run] = key;
    FlightFiles flight;
    const fs::path place = fs::absolute(folder).lexically_normal();
    flight.scenario = (place.has_filename() ? place : place.parent_path()).filename().string();
    if (!prefix.empty()) flight.scenario += "/" + prefix;
    flight.run = run;
    flight.name = flight.scenario + "/" + (run < 10 ? "0" : "") + std::to_string(run);
    flight.logs.assign(vehicles.begin(), vehicles.end());
    result.flights.push_back(std::move(flight));
  }
  if (result.flights.empty()) {
    throw files::InputError({paths.empty() ? "" : paths[0], "", "", "", "there is no flight log here",
                             "logs are named [<prefix>_]cf<id>_<run>, with or without .csv"});
  }
  return result;
}

Fleet read_fleet(const std::string& path) {
  const toml::table document = files::parse_toml(files::read_file(path), path);
  const files::TomlTable root(document, path);
  root.choice("schema", {"swarmcert/flights/1"});
  root.allow_only({"schema", "vehicle"});
  Fleet fleet;
  const files::TomlTable vehicles = root.table("vehicle");
  for (const std::string& name : vehicles.keys()) {
    const files::TomlTable table = vehicles.table(name);
    table.allow_only({"model", "use"});
    VehicleUse use;
    use.model = (fs::path(path).parent_path() / table.text("model")).string();
    use.kind = stability::read_model(use.model).kind;
    if (table.has("use")) use.position_only = table.choice("use", {"all", "position"}) == 1;
    fleet[name] = use;
  }
  return fleet;
}

}  // namespace swarmcert::residuals
