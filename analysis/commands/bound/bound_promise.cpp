#include "analysis/commands/bound/bound_promise.h"

#include <fmt/core.h>

#include <set>

#include "analysis/commands/bound/bound_output.h"
#include "analysis/tracking/flight_promise.h"
#include "nn/base/input_error.h"

namespace swarmcert::analysis {

namespace {

/// SHA-256 of every file that compare read, including the logs of the flights.
files::Json logs_of(const std::string& compared) {
  files::Json hashes = files::Json::array();
  for (const files::Json& input :
       files::read_json(compared, "swarmcert/compare/1").value("inputs", files::Json::array())) {
    if (input.is_object() && input.contains("sha256") && input["sha256"].is_string())
      hashes.push_back(input["sha256"]);
  }
  return hashes;
}

}  // namespace

files::Json promise_json(const Tracking& input, const stability::TrackingReport& report,
                         const stability::DisturbanceSource& declared, const stability::InitialError& initial,
                         const std::string& from, double level) {
  const std::vector<FlightClass> flights = read_flight_classes(from);
  std::set<std::string> names;
  for (const FlightClass& flight : flights) names.insert(flight.flight);
  const int fewest = fewest_groups(level);
  if (static_cast<int>(names.size()) < fewest) {
    throw files::InputError({from, "", "flights", std::to_string(names.size()),
                             fmt::format("are too few: a promise of {:g} needs at least {}", level, fewest),
                             "compare more flights, or ask for less with --coverage"});
  }
  files::Json json = {{"level", level}, {"flights", names.size()}, {"vehicles", flights.size()}};
  json["made_from"] = logs_of(from);
  json["bounds"] = files::Json::array();
  for (const PromisedBound& row : promised_bounds(input, report, flights, declared, initial, level)) {
    json["interval"] = row.promise.coverage_90;  // identical for all rows
    json["bounds"].push_back({{"axis", stability::axis_name(row.axis)},
                              {"channel", stability::name(row.channel)},
                              {"loop", stability::name(row.loop)},
                              {"total", finite(row.promise.threshold)},
                              {"unit", "m"}});
  }
  json["like_them"] =
      "a flight whose force error is drawn from the same distribution as in these flights: same vehicles, "
      "tasks and model";
  json["rests_on"] = "the linear loop with the lags of gains.toml; force errors below " +
                     std::string("the bandwidth that compare states; windows that follow one another");
  return json;
}

void print_promise(const files::Json& promise) {
  const files::Json& interval = promise["interval"];
  fmt::print(
      "\nA further flight like the {} that were compared stays below with probability {:g} ({:.3f} to {:.3f} "
      "for these flights, 90 %):\n",
      promise["flights"].get<std::size_t>(), promise["level"].get<double>(), interval[0].get<double>(),
      interval[1].get<double>());
  for (const files::Json& row : promise["bounds"]) {
    fmt::print("  {} {:<8} {:<11} {}\n", row["axis"].get<std::string>(), row["channel"].get<std::string>(),
               row["loop"].get<std::string>(),
               row["total"].is_number() ? fmt::format("{:.4g} m", row["total"].get<double>())
                                        : std::string("no bound"));
  }
  fmt::print("  like them: {}\n", promise["like_them"].get<std::string>());
}

}  // namespace swarmcert::analysis
