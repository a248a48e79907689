#include "analysis/identification/fleet/each.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "analysis/identification/fleet/flight_groups.h"
#include "analysis/identification/rotors/rotor_fit.h"
#include "analysis/residuals/statistics.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::Inputs;
using stability::EffectSpec;
using stability::Family;

constexpr std::size_t kFewestForOutliers = 5, kFewestForDrift = 5;

constexpr char kLag[] = "lag_s";

/// The effect and parameter from which a value of the table is taken.
struct NumberSource {
  std::string number, effect, parameter;
  double nominal;  ///< added to the parameter
};
std::vector<NumberSource> number_sources() {
  const std::string ratio = stability::plain_effect(Family::kThrustScale),
                    drag = stability::plain_effect(Family::kDrag),
                    lag = stability::plain_effect(Family::kLate);
  const std::string per_speed = stability::effect_info(drag).linear[0].name;
  return {{ratio, ratio, stability::effect_info(ratio).linear[0].name, 1},
          {per_speed, drag, per_speed, 0},
          {kLag, lag, stability::effect_info(lag).shape[0].name, 0}};
}

void erase_fitted(std::vector<EffectSpec>& effects, bool keeps_lag) {
  for (const NumberSource& source : number_sources()) {
    if (keeps_lag && source.number == kLag) continue;
    effects.erase(std::remove_if(effects.begin(), effects.end(),
                                 [&](const EffectSpec& spec) { return spec.name == source.effect; }),
                  effects.end());
  }
}

double error_of(const FlightNumber& number) {
  static const double kNormal = boost::math::quantile(boost::math::normal(), 0.95);
  return (number.interval.upper - number.interval.lower) / (2 * kNormal);
}

/// Returns whether a flight determines a value, i.e. whether its interval is narrower than the bounds of the effect. A
/// lag also needs the gain of a lag; for the others the error must be less than a tenth of the weight, for drag at a
/// speed of 1 m/s.
bool shows(const NumberSource& source, const Missing& fit, const Interval& interval, double weight_N) {
  const double half = (interval.upper - interval.lower) / 2;
  if (!(half > 0) || !std::isfinite(half)) return false;
  if (source.number == kLag) {
    const auto gain = fit.intervals.find("gain");
    const double value = fit.parameters.at("gain");
    const bool is_lag = std::abs(value - 1) < 0.999 * kMemoryTolerance;
    return is_lag && half < 0.5 * fit.parameters.at(source.parameter) && gain != fit.intervals.end();
  }
  return half < (source.nominal == 1 ? 0.1 : 0.1 * weight_N);
}

FlightNumbers flight_numbers(const std::vector<Missing>& fitted, double weight_N) {
  FlightNumbers numbers;
  for (const NumberSource& source : number_sources()) {
    FlightNumber& number = numbers[source.number];
    for (const Missing& fit : fitted) {
      const auto interval = fit.intervals.find(source.parameter);
      if (fit.effect != source.effect || interval == fit.intervals.end()) continue;
      number.is_observable = shows(source, fit, interval->second, weight_N);
      number.value = source.nominal + fit.parameters.at(source.parameter);
      number.interval = {source.nominal + interval->second.lower, source.nominal + interval->second.upper};
    }
  }
  return numbers;
}

/// The flights of one vehicle, with the models used for the fit.
struct Fleet {
  Inputs bare;      ///< without any of these values
  Inputs with_lag;  ///< with the lag common to all flights
};

/// Fits all three values if the flight shows a lag, else ratio and drag beside the common lag.
FlightNumbers fit_flight(const Fleet& own, const std::string& kind, int flight, double weight_N, int jobs) {
  const auto silent = [](int, int) {};
  std::vector<std::string> names;
  for (const NumberSource& source : number_sources()) names.push_back(source.effect);
  FlightNumbers numbers =
      flight_numbers(fit_effects(own.bare, kind, names, {flight}, jobs, silent), weight_N);
  if (numbers[kLag].is_observable) return numbers;
  names.pop_back();
  return flight_numbers(fit_effects(own.with_lag, kind, names, {flight}, jobs, silent), weight_N);
}

/// Adds the factor of each rotor in one flight of a vehicle, if the flight contains slow flight.
void add_rotors(const Inputs& own, const std::string& kind, const std::string& vehicle, int flight,
                FlightNumbers& numbers) {
  constexpr double kMostHalfWidth = 0.1;
  Inputs one = own;
  one.found.flights = {own.found.flights[static_cast<std::size_t>(flight)]};
  for (const RotorLoads& loads : rotor_loads(one, kind, 1)) {
    if (loads.vehicle != vehicle) continue;
    const RotorFactors factors = rotor_factors(loads);
    for (std::size_t k = 0; k < factors.size(); ++k) {
      const Interval interval = factors[k].interval;
      const double half = (interval.upper - interval.lower) / 2;
      numbers["rotor_" + std::to_string(k + 1)] = {half > 0 && half < kMostHalfWidth, factors[k].value,
                                                   interval};
    }
  }
}

/// Returns `number` of the flights that show it.
std::vector<FlightNumber*> flights_with(std::vector<EachFlight>& flights, const std::string& number) {
  std::vector<FlightNumber*> all;
  for (EachFlight& flight : flights) {
    const auto found = flight.numbers.find(number);
    if (found != flight.numbers.end() && found->second.is_observable) all.push_back(&found->second);
  }
  return all;
}

void mark_outliers(const std::vector<FlightNumber*>& numbers) {
  constexpr double kFar = 3.5, kDeviationOfMedian = 1.4826;
  if (numbers.size() < kFewestForOutliers) return;
  std::vector<double> values, distances;
  for (const FlightNumber* number : numbers) values.push_back(number->value);
  const double median = residuals::quantile(values, 0.5);
  for (const double value : values) distances.push_back(std::abs(value - median));
  const double deviation = kDeviationOfMedian * residuals::quantile(distances, 0.5);
  for (FlightNumber* number : numbers)
    number->is_outlier = std::abs(number->value - median) > kFar * std::hypot(deviation, error_of(*number));
}

/// Least squares over the flights that are not outliers. The error is the scatter about the line, because flights
/// differ by more than their own errors.
Drift drift_of(const std::vector<FlightNumber*>& numbers) {
  Drift drift;
  std::vector<double> at, value;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i]->is_outlier) continue;
    at.push_back(static_cast<double>(i));
    value.push_back(numbers[i]->value);
  }
  const auto n = static_cast<double>(at.size());
  drift.flights = static_cast<int>(at.size());
  if (at.size() < kFewestForDrift) return drift;
  double mean_at = 0, mean = 0, along = 0, across = 0, left = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    mean_at += at[i] / n;
    mean += value[i] / n;
  }
  for (std::size_t i = 0; i < at.size(); ++i) {
    along += (at[i] - mean_at) * (at[i] - mean_at);
    across += (at[i] - mean_at) * (value[i] - mean);
  }
  drift.per_flight = across / along;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double rest = value[i] - mean - drift.per_flight * (at[i] - mean_at);
    left += rest * rest;
  }
  const double error = std::sqrt(left / (n - 2) / along);
  const boost::math::students_t student(n - 2);
  const double half = error * boost::math::quantile(student, 0.95);
  drift.interval = {drift.per_flight - half, drift.per_flight + half};
  drift.is_there = std::abs(drift.per_flight) > error * boost::math::quantile(student, 0.995);
  return drift;
}

/// Returns the mean of values weighted by their errors and by the scatter between them (DerSimonian and Laird 1986).
FlightNumber mean_of(const std::vector<FlightNumber>& numbers) {
  FlightNumber mean;
  if (numbers.empty()) return mean;
  double weights = 0, squares = 0, sum = 0, heterogeneity = 0;
  for (const FlightNumber& number : numbers) {
    const double weight = 1 / (error_of(number) * error_of(number));
    weights += weight;
    squares += weight * weight;
    sum += weight * number.value;
  }
  for (const FlightNumber& number : numbers) {
    const double off = (number.value - sum / weights) / error_of(number);
    heterogeneity += off * off;
  }
  const double freedom = static_cast<double>(numbers.size()) - 1;
  const double between =
      freedom > 0 ? std::max(0.0, (heterogeneity - freedom) / (weights - squares / weights)) : 0;
  weights = sum = 0;
  for (const FlightNumber& number : numbers) {
    const double weight = 1 / (error_of(number) * error_of(number) + between);
    weights += weight;
    sum += weight * number.value;
  }
  const double half = boost::math::quantile(boost::math::normal(), 0.95) / std::sqrt(weights);
  mean.is_observable = true;
  mean.value = sum / weights;
  mean.interval = {mean.value - half, mean.value + half};
  return mean;
}

std::vector<EachDay> days_of(const std::vector<EachFlight>& flights) {
  std::map<std::string, std::vector<const EachFlight*>> by_day;
  for (const EachFlight& flight : flights) {
    if (flight.too_poor.empty()) by_day[flight.day].push_back(&flight);
  }
  std::vector<EachDay> days;
  for (const auto& [name, members] : by_day) {
    EachDay day{name, members[0]->vehicle, members[0]->kind, static_cast<int>(members.size()), {}};
    for (const std::string& number : each_numbers()) {
      std::vector<FlightNumber> seen_on_day;
      for (const EachFlight* flight : members) {
        const auto own = flight->numbers.find(number);
        if (own != flight->numbers.end() && own->second.is_observable) seen_on_day.push_back(own->second);
      }
      day.numbers[number] = mean_of(seen_on_day);
    }
    days.push_back(std::move(day));
  }
  return days;
}

std::vector<EachFlight> flights_of(const Fleet& own, const std::string& vehicle, const std::string& kind,
                                   double weight_N, int jobs) {
  std::vector<EachFlight> flights;
  for (const int i : every_flight(own.bare)) {
    const residuals::FlightFiles& files = own.bare.found.flights[static_cast<std::size_t>(i)];
    EachFlight flight{files.name, folder_of(files), vehicle, kind, 0, "", {}};
    const Coverage covered = coverage(own.bare, kind, {i}, jobs);
    flight.blocks = covered.blocks;
    flight.too_poor = covered.too_poor();
    if (flight.too_poor.empty()) {
      flight.numbers = fit_flight(own, kind, i, weight_N, jobs);
      add_rotors(own.bare, kind, vehicle, i, flight.numbers);
    }
    flights.push_back(std::move(flight));
  }
  return flights;
}

}  // namespace

std::vector<std::string> each_numbers() {
  std::vector<std::string> names;
  for (const NumberSource& source : number_sources()) names.push_back(source.number);
  for (const char* rotor : {"rotor_1", "rotor_2", "rotor_3", "rotor_4"}) names.emplace_back(rotor);
  return names;
}

Each each_flight(const Inputs& inputs, const std::string& kind, const std::vector<EffectSpec>& common,
                 int jobs, const residuals::Progress& progress) {
  Each result;
  stability::Model bare = with_effects(*inputs.model_of(kind), common), with_lag = bare;
  erase_fitted(bare.effects, false);
  erase_fitted(with_lag.effects, true);
  result.held = bare.effects;
  const std::vector<std::string> vehicles = coverage(inputs, kind, every_flight(inputs), jobs).vehicles;
  int done = 0;
  for (const std::string& vehicle : vehicles) {
    const Inputs own = of_one_vehicle(inputs, kind, vehicle);
    std::vector<EachFlight> flights =
        flights_of({with_model_of_kind(own, kind, bare), with_model_of_kind(own, kind, with_lag)}, vehicle,
                   kind, bare.weight_N(), jobs);
    for (const std::string& number : each_numbers()) {
      const std::vector<FlightNumber*> numbers = flights_with(flights, number);
      mark_outliers(numbers);
      Drift drift = drift_of(numbers);
      drift.number = number;
      drift.vehicle = vehicle;
      drift.kind = kind;
      if (drift.flights >= static_cast<int>(kFewestForDrift)) result.drifts.push_back(std::move(drift));
    }
    for (EachDay& day : days_of(flights)) result.days.push_back(std::move(day));
    result.flights.insert(result.flights.end(), flights.begin(), flights.end());
    progress(++done, static_cast<int>(vehicles.size()));
  }
  return result;
}

}  // namespace swarmcert::identification
