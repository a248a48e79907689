#include "analysis/tracking/flight_promise.h"

#include <array>
#include <cmath>
#include <limits>

#include "analysis/tracking/measured_source.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

/// |number| for an axis; infinite if the axis was not judged.
double size_along(const Json& error, const std::string& of, const char* key, int axis,
                  const std::string& path) {
  const std::string field = of + "." + key;
  if (!error.contains(key) || !error[key].is_object() || !error[key].contains(stability::axis_name(axis))) {
    throw files::InputError(
        {path, "", field, "", "is missing", "write the file with swarmcert compare --json"});
  }
  const Json& value = error[key][stability::axis_name(axis)];
  if (value.is_null()) return std::numeric_limits<double>::infinity();
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    throw files::InputError({path, "", field, value.dump().substr(0, 40), "is not a number", ""});
  return std::abs(value.get<double>());
}

MeasuredAxis measured_axis(const Json& error, const std::string& field, int axis, const std::string& path) {
  const auto size = [&](const char* key) { return size_along(error, field, key, axis, path); };
  return {size("bias"), size("amplitude"), size("rate"), size("variation"), size("impulse")};
}

/// @param velocity null if the log does not measure it.
stability::DisturbanceSource source_of(const Json& force, const Json& velocity, double window_s,
                                       const std::string& path) {
  std::array<MeasuredAxis, 3> axes;
  for (int axis = 0; axis < 3; ++axis)
    axes[static_cast<std::size_t>(axis)] = measured_axis(force, "flights.learning_error", axis, path);
  stability::DisturbanceSource source = measured_source(axes, window_s);
  for (int axis = 0; axis < 3 && velocity.is_object(); ++axis) {
    source.velocity_error[axis] =
        measured_estimate(measured_axis(velocity, "flights.velocity_error", axis, path), window_s);
  }
  return source;
}

/// Adds what acts in addition to the class; a declared error of the velocity replaces the measured one.
void add_declared(const stability::DisturbanceSource& declared, stability::DisturbanceSource& source) {
  source.thrust_ratio_error = declared.thrust_ratio_error;
  for (int axis = 0; axis < 3; ++axis) {
    if (declared.bias_N[axis] != 0) source.classes_contain_bias = false;
    source.bias_N[axis] += std::abs(declared.bias_N[axis]);
    if (declared.declares_velocity_error) source.velocity_error[axis] = declared.velocity_error[axis];
    source.position_error[axis] = declared.position_error[axis];
  }
}

}  // namespace

std::vector<FlightClass> read_flight_classes(const std::string& path) {
  const Json document = files::read_json(path, "swarmcert/compare/1");
  const auto refuse = [&path](const std::string& field, const std::string& what) -> void {
    throw files::InputError({path, "", field, "", what, "write the file with swarmcert compare --json"});
  };
  if (!document.contains("flights") || !document["flights"].is_array()) refuse("flights", "is missing");
  if (document.value("unit", "N") != "N") {
    throw files::InputError({path, "", "unit", files::in_quotes(document.value("unit", "")),
                             "is not a unit of force",
                             "name vehicles with a mass, so that compare judges forces"});
  }
  const Json* const summary = document.contains("learning_error") ? &document["learning_error"] : nullptr;
  if (summary == nullptr || !summary->contains("window_s") || !(*summary)["window_s"].is_number() ||
      !((*summary)["window_s"].get<double>() > 0))
    refuse("learning_error.window_s", "is not a positive number");
  std::vector<FlightClass> flights;
  for (const Json& flight : document["flights"]) {
    if (!flight.is_object() || !flight.contains("learning_error"))
      refuse("flights.learning_error", "is missing: the file is of an older version");
    if (!flight["learning_error"].is_object()) continue;
    flights.push_back({flight.value("flight", ""), flight.value("vehicle", ""),
                       source_of(flight["learning_error"], flight.value("velocity_error", Json()),
                                 (*summary)["window_s"].get<double>(), path)});
  }
  return flights;
}

std::vector<PromisedBound> promised_bounds(const stability::FlownLoop& loop,
                                           const stability::TrackingReport& report,
                                           const std::vector<FlightClass>& flights,
                                           const stability::DisturbanceSource& declared,
                                           const stability::InitialError& initial, double level) {
  std::vector<PromisedBound> rows;
  for (std::size_t k = 0; k < report.exact.size(); ++k) {
    const stability::ExactGains& exact = report.exact[k];
    double beside_m = 0;
    for (const stability::AxisBounds& row : report.bounds) {
      if (row.axis == exact.axis && row.channel == exact.channel && row.loop == exact.loop)
        beside_m = row.staircase_m + row.float32_m;
    }
    std::vector<FlightScore> scores;
    for (const FlightClass& flight : flights) {
      stability::DisturbanceSource source = flight.source;
      add_declared(declared, source);
      scores.push_back({flight.flight, beside_m + axis_bounds(loop, exact, source, initial).least()});
    }
    rows.push_back({exact.axis, exact.channel, exact.loop, conformal_threshold(scores, level)});
  }
  return rows;
}

}  // namespace swarmcert::analysis
