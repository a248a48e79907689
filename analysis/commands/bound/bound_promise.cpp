#include "analysis/commands/bound/bound_promise.h"

#include <fmt/core.h>

#include <cmath>
#include <set>

#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {
namespace {

std::vector<std::string> logs_of(const std::string& compared) {
  std::vector<std::string> hashes;
  for (const files::Json& input :
       files::read_json(compared, "swarmcert/compare/1").value("inputs", files::Json::array())) {
    if (input.is_object() && input.contains("sha256") && input["sha256"].is_string())
      hashes.push_back(input["sha256"].get<std::string>());
  }
  return hashes;
}

/// Quantiles of the probability; identical for all rows.
Interval interval_of(const CoverageBound& promise) {
  return promise.bounds.empty() ? Interval() : promise.bounds.front().promise.coverage_90;
}

constexpr char kLikeThem[] =
    "a flight whose force error is drawn from the same distribution as in these flights: same vehicles, "
    "tasks and model";

}  // namespace

void describe(files::Record& record, const CoverageBound& promise) {
  record.field("level", promise.level, "Probability with which a further flight stays below.");
  record.field("flights", promise.flights, "Flights that were compared.");
  record.field("vehicles", promise.vehicles, "Vehicles in them, one row each.");
  record.field("made_from", promise.made_from, "SHA-256 of every file that compare read, logs included.");
  record.field("interval", interval_of(promise),
               "5 % and 95 % quantiles of the probability, given these flights.");
  record.list(
      "bounds", promise.bounds, "Per row of bounds[].", [](files::Record& r, const PromisedBound& row) {
        r.field("axis", stability::axis_name(row.axis), "");
        r.field("channel", name(row.channel), "");
        r.field("loop", name(row.loop), "");
        r.field("total", row.promise.threshold, "Null: no bound.", "m", "holds with probability `level`");
        r.constant("unit", "m", "");
      });
  record.field("like_them", kLikeThem, "Which flights are promised.");
  record.field(
      "rests_on",
      "the linear loop with the lags of gains.toml; force errors below the bandwidth that compare states; "
      "windows that follow one another",
      "");
}

CoverageBound promise_of(const Tracking& input, const stability::TrackingReport& report,
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
  return {level, names.size(), flights.size(), logs_of(from),
          promised_bounds(input, report, flights, declared, initial, level)};
}

void print(const CoverageBound& promise) {
  const Interval interval = interval_of(promise);
  fmt::print(
      "\nA further flight like the {} that were compared stays below with probability {:g} ({:.3f} to {:.3f} "
      "for these flights, 90 %):\n",
      promise.flights, promise.level, interval.lower, interval.upper);
  for (const PromisedBound& row : promise.bounds) {
    const double total_m = row.promise.threshold;
    fmt::print("  {} {:<8} {:<11} {}\n", stability::axis_name(row.axis), name(row.channel), name(row.loop),
               std::isfinite(total_m) ? fmt::format("{:.4g} m", total_m) : std::string("no bound"));
  }
  fmt::print("  like them: {}\n", kLikeThem);
}

}  // namespace swarmcert::analysis
