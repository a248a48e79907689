#include "analysis/identification/flight_split.h"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>

#include "analysis/identification/diagnose.h"
#include "nn/base/doubles.h"

namespace swarmcert::identification {
namespace {

/// Parts of a flight are at least this long. Errors are correlated over blocks of 2 s, so as much lies between parts.
constexpr double kShortestPart_s = 8, kGuard_s = 2;

/// Returns five parts of `flight`, as five flights are split; none if they would be too short.
std::vector<residuals::FlightFiles> parts_of(const residuals::FlightFiles& flight, Interval span_s) {
  constexpr int kParts = 5;
  const double whole_s = span_s.upper - span_s.lower;
  std::vector<residuals::FlightFiles> parts;
  if (!(whole_s / kParts >= kShortestPart_s + kGuard_s)) return parts;
  for (int k = 0; k < kParts; ++k) {
    residuals::FlightFiles part = flight;
    const double begin_s = span_s.lower + whole_s * k / kParts;
    part.part_s = {begin_s, begin_s + whole_s / kParts - kGuard_s};
    part.name += fmt::format(" {:.0f}..{:.0f} s", part.part_s->lower, part.part_s->upper);
    parts.push_back(std::move(part));
  }
  return parts;
}

/// Replaces the flights of `inputs` by their parts. Returns false, and changes nothing, if a flight is too short.
bool split_in_time(residuals::Inputs& inputs) {
  std::vector<residuals::FlightFiles> parts;
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) {
    Interval span_s = {kInfinity, -kInfinity};
    std::vector<std::string> problems;
    for (const residuals::Track& track : inputs.load(i, problems)) {
      if (track.position_only) continue;
      for (std::size_t k = 0; k < track.cut.size(); ++k) {
        if (track.cut[k] != residuals::Cut::kNone) continue;
        span_s.lower = std::min(span_s.lower, track.instants[k].time_s);
        span_s.upper = std::max(span_s.upper, track.instants[k].time_s);
      }
    }
    std::vector<residuals::FlightFiles> own = parts_of(inputs.found.flights[i], span_s);
    if (own.empty()) return false;
    std::move(own.begin(), own.end(), std::back_inserter(parts));
  }
  inputs.found.flights = std::move(parts);
  return true;
}

}  // namespace

Split split_flights(residuals::Inputs& inputs) {
  Split split;
  if (inputs.found.flights.size() < 3) {
    split.by = split_in_time(inputs) ? Split::By::kTime : Split::By::kNothing;
    if (split.by == Split::By::kNothing) {
      split.fit = split.select = split.test = every_flight(inputs);
      return split;
    }
  }
  const auto count = static_cast<int>(inputs.found.flights.size());
  for (int i = 0; i < count; ++i) {
    const bool few = count < 5;
    const bool test = few ? i == count - 1 : i % 5 == 4;
    const bool select = few ? i == count - 2 : i % 5 == 2;
    (test ? split.test : select ? split.select : split.fit).push_back(i);
  }
  return split;
}

}  // namespace swarmcert::identification
