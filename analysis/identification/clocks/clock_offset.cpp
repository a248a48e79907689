#include "analysis/identification/clocks/clock_offset.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>

#include "analysis/identification/clocks/clock_placement.h"
#include "analysis/identification/clocks/clock_search.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

/// Fraction of the mutual explanation of two vehicles that the offset of their clocks must contribute. Among n clocks,
/// tying two of them separates them by the offset d and at best by half of it, d / 2, from the others in 2 (n - 2)
/// pairs; averaged over all n (n - 1) / 2 pairs this is d^2 / (n - 1) if the loss is quadratic.
constexpr double kLeastGain = 0.05;
constexpr double kLeastZ = 3;
constexpr double kStudent90 = 1.833;  ///< for nine degrees of freedom

/// The vehicles of a flight whose vertical force is judged, and the clocks they share.
struct Clocks {
  std::vector<const Track*> tracks;
  std::vector<int> of;  ///< clock of each track; 0: that of the first log
  int count = 0;

  int logs(int clock) const { return static_cast<int>(std::count(of.begin(), of.end(), clock)); }
};

Clocks clocks_of(const std::vector<Track>& tracks) {
  Clocks clocks;
  bool has_first = false;
  for (const Track& track : tracks) {
    if (track.position_only || track.judged.z() != 1) continue;
    clocks.tracks.push_back(&track);
    const bool is_known = track.has_reference_clock || track.has_absolute_clock || track.clock_onsets > 0;
    has_first = has_first || is_known;
    clocks.of.push_back(is_known ? 0 : ++clocks.count);
  }
  // If nothing is related to the first log, use the first judged vehicle instead.
  if (!has_first)
    for (int& clock : clocks.of) --clock;
  clocks.count += has_first ? 1 : 0;
  return clocks;
}

/// A flight, read with the clock offsets known so far.
struct Reading {
  std::vector<Track> tracks;
  Clocks clocks;
  std::vector<std::vector<Eigen::Vector3d>> r;  ///< residuals of clocks.tracks, in W
};

Reading read_flight(const residuals::Inputs& inputs, std::size_t flight) {
  std::vector<std::string> problems;  // reported by the diagnosis
  Reading reading;
  reading.tracks = inputs.load(flight, problems);
  reading.clocks = clocks_of(reading.tracks);
  if (reading.clocks.count < 2) return reading;
  for (const Track* track : reading.clocks.tracks)
    reading.r.push_back(force_residual(inputs.model_for(*track), inputs.kinds, inputs.rules, *track));
  return reading;
}

/// @param without the clock whose vehicles are left out, and after which the clocks are numbered anew; -1: none
ClockSearch search_of(const Reading& reading, int without = -1) {
  const Clocks& clocks = reading.clocks;
  std::vector<Interplay> interplays;
  std::vector<int> of;
  for (std::size_t v = 0; v < clocks.tracks.size(); ++v) {
    if (clocks.of[v] == without) continue;
    std::vector<const Track*> others;
    for (std::size_t other = 0; other < clocks.tracks.size(); ++other)
      if (other != v && clocks.of[other] != without) others.push_back(clocks.tracks[other]);
    interplays.emplace_back(*clocks.tracks[v], reading.r[v], others);
    of.push_back(without >= 0 && clocks.of[v] > without ? clocks.of[v] - 1 : clocks.of[v]);
  }
  return {std::move(interplays), std::move(of), clocks.count - (without < 0 ? 0 : 1)};
}

/// @param ahead_s of each clock
std::vector<ClockedVehicle> clocked_vehicles(const Reading& reading, const std::vector<double>& ahead_s) {
  std::vector<ClockedVehicle> vehicles;
  for (std::size_t v = 0; v < reading.clocks.tracks.size(); ++v) {
    const int clock = reading.clocks.of[v];
    vehicles.push_back(
        {reading.clocks.tracks[v], &reading.r[v], clock, ahead_s[static_cast<std::size_t>(clock)]});
  }
  return vehicles;
}

/// Returns whether the offset of `clock` from `reference` stands out from its rivals. The other clocks are estimated
/// without `clock`, so that they do not favour the offset that the search found.
bool offset_stands_out(const Reading& reading, const ClockSteps& steps, int clock, int reference) {
  const auto count = static_cast<std::size_t>(reading.clocks.count);
  std::vector<double> ahead_s(count, 0);
  double delay_s = 0;
  const auto others = static_cast<int>(reading.clocks.tracks.size()) - reading.clocks.logs(clock);
  if (others > 1) {
    const ClockSteps found = search_of(reading, clock).best();
    for (std::size_t k = 0; k < count; ++k) {
      const int index = static_cast<int>(k) - (static_cast<int>(k) > clock ? 1 : 0);
      if (static_cast<int>(k) != clock)
        ahead_s[k] = kClockStep_s * found.clock[static_cast<std::size_t>(index)];
    }
    delay_s = kClockStep_s * found.delay;
  }
  const auto at = [&](int k) { return kClockStep_s * steps.clock[static_cast<std::size_t>(k)]; };
  const double expected_s = ahead_s[static_cast<std::size_t>(reference)] + at(clock) - at(reference);
  return is_related(clocked_vehicles(reading, ahead_s), clock, delay_s, expected_s);
}

/// Returns the largest set of clocks whose vehicles feel one another in a cycle, which separates delays and offsets.
std::vector<int> circle(ClockSearch& search, const ClockSteps& steps, int clocks) {
  const auto count = static_cast<std::size_t>(clocks);
  std::vector<std::vector<char>> reaches(count, std::vector<char>(count, 0));
  for (int a = 0; a < clocks; ++a)
    for (int b = 0; b < clocks; ++b)
      if (a != b)
        reaches[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] = search.feels(a, b, steps);
  for (std::size_t via = 0; via < count; ++via)
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = 0; b < count; ++b)
        if (reaches[a][via] != 0 && reaches[via][b] != 0) reaches[a][b] = 1;
  std::vector<int> largest;
  for (std::size_t a = 0; a < count; ++a) {
    std::vector<int> around;
    for (std::size_t b = 0; b < count; ++b)
      if (a == b || (reaches[a][b] != 0 && reaches[b][a] != 0)) around.push_back(static_cast<int>(b));
    if (around.size() > largest.size()) largest = around;
  }
  return largest;
}

/// Sorts the clocks of `around`: first those shared by most logs, and among these the middle ones first.
std::vector<int> from_the_middle(const Clocks& clocks, std::vector<int> around,
                                 const Eigen::VectorXd& offsets_s) {
  const std::vector<int> all = around;
  // Integer nanoseconds, so that round-off does not decide the order.
  const auto away_ns = [&](int clock) {
    double sum_s = 0;
    for (const int other : all) sum_s += std::abs(offsets_s(other) - offsets_s(clock));
    return std::llround(1e9 * sum_s);
  };
  std::stable_sort(around.begin(), around.end(), [&](int a, int b) {
    if (clocks.logs(a) != clocks.logs(b)) return clocks.logs(a) > clocks.logs(b);
    return away_ns(a) < away_ns(b);
  });
  return around;
}

/// Returns the offsets of all clocks without each tenth of the flight.
std::array<Eigen::VectorXd, kClockTenths> left_out(ClockSearch& search, const ClockSteps& steps) {
  std::array<Eigen::VectorXd, kClockTenths> offsets_s;
  for (int t = 0; t < kClockTenths; ++t)
    offsets_s[static_cast<std::size_t>(t)] = search.offsets_s(search.climbed(steps, t), t);
  return offsets_s;
}

double jackknife_s(const std::array<Eigen::VectorXd, kClockTenths>& offsets_s, int clock, int reference) {
  double mean = 0, variance = 0;
  const auto of = [&](const Eigen::VectorXd& one) { return one(clock) - one(reference); };
  for (const Eigen::VectorXd& one : offsets_s) mean += of(one) / kClockTenths;
  for (const Eigen::VectorXd& one : offsets_s) variance += (of(one) - mean) * (of(one) - mean);
  // Offsets between grid steps are interpolated by a parabola.
  return std::hypot(std::sqrt(variance * (kClockTenths - 1) / kClockTenths), kClockStep_s / 4);
}

/// A clock that may differ from the reference.
struct Suspect {
  int clock = 0;
  double alike_N2 = 0;  ///< explained with both clocks equal
};

std::vector<Suspect> suspects(ClockSearch& search, const ClockSteps& steps, const std::vector<int>& around,
                              int reference, int clocks) {
  std::vector<Suspect> found;
  const double all_N2 = search.value(steps);
  const auto at = [&](int clock) { return steps.clock[static_cast<std::size_t>(clock)]; };
  for (const int clock : around) {
    if (clock == reference || at(clock) == at(reference) ||
        std::abs(at(clock) - at(reference)) >= kClockSteps)
      continue;
    const ClockSteps alike = search.best({std::min(clock, reference), std::max(clock, reference)});
    const double alike_N2 = search.value(alike);
    if (all_N2 - alike_N2 > kLeastGain / (clocks - 1) * all_N2) found.push_back({clock, alike_N2});
  }
  return found;
}

/// Estimates for a flight.
struct Estimate {
  ClockSteps steps;
  Eigen::VectorXd offsets_s;
  std::array<Eigen::VectorXd, kClockTenths> without_s;  ///< without each tenth
};

ClockOffset offset_of(const Clocks& clocks, ClockSearch& search, const Estimate& estimate,
                      const Suspect& suspect, int reference) {
  const double squares_N2 = search.squares_N2(), n = search.records();
  const auto rmse_N = [&](double explained_N2) {
    return std::sqrt(std::max(0.0, squares_N2 - explained_N2) / n);
  };
  const auto first = [&](int clock) {
    return clocks.tracks[static_cast<std::size_t>(std::find(clocks.of.begin(), clocks.of.end(), clock) -
                                                  clocks.of.begin())];
  };
  ClockOffset found;
  found.offset_s = estimate.offsets_s(suspect.clock) - estimate.offsets_s(reference);
  const double deviation_s = jackknife_s(estimate.without_s, suspect.clock, reference);
  found.interval = {found.offset_s - kStudent90 * deviation_s, found.offset_s + kStudent90 * deviation_s};
  found.delay_s = estimate.steps.delay * kClockStep_s;
  found.records = search.records();
  found.z = std::abs(found.offset_s) / deviation_s;
  found.rmse_before_N = rmse_N(suspect.alike_N2);
  found.rmse_after_N = rmse_N(search.value(estimate.steps));
  found.logs = static_cast<int>(clocks.tracks.size());
  const Track &own = *first(suspect.clock), &other = *first(reference);
  found.flight = own.flight;
  found.vehicle = own.vehicle;
  found.kind = own.kind;
  found.path = own.path;
  found.against = other.path;
  found.against_vehicle = other.vehicle;
  found.correction_s = own.clock_offset_s + found.offset_s;
  return found;
}

/// Returns the offsets within the range of the search.
std::vector<ClockOffset> offsets_of(const Reading& reading) {
  ClockSearch search = search_of(reading);
  if (!search.is_rich()) return {};
  const Clocks& clocks = reading.clocks;
  Estimate estimate = {search.best(), {}, {}};
  const std::vector<int> around = circle(search, estimate.steps, clocks.count);
  if (around.size() < 2) return {};
  estimate.offsets_s = search.offsets_s(estimate.steps, -1);
  // Clocks on either side of the middle one may differ from each other even if neither significantly differs from it.
  for (const int reference : from_the_middle(clocks, around, estimate.offsets_s)) {
    std::vector<ClockOffset> result;
    for (const Suspect& suspect : suspects(search, estimate.steps, around, reference, clocks.count)) {
      if (estimate.without_s[0].size() == 0) estimate.without_s = left_out(search, estimate.steps);
      ClockOffset found = offset_of(clocks, search, estimate, suspect, reference);
      if (found.z > kLeastZ && offset_stands_out(reading, estimate.steps, suspect.clock, reference))
        result.push_back(std::move(found));
    }
    if (result.empty()) continue;
    const bool is_related = clocks.count == 2 || offset_stands_out(reading, estimate.steps, reference,
                                                                   around[around[0] == reference ? 1 : 0]);
    if (is_related) return result;
  }
  return {};
}

/// Returns the fraction of the sum of squares that is explained if all clocks are equal.
double explained_if_equal(const Reading& reading) {
  ClockSearch search = search_of(reading);
  double most_N2 = 0;
  for (int delay = 0; delay <= kWakeSteps; ++delay)
    most_N2 = std::max(
        most_N2, search.value({std::vector<int>(static_cast<std::size_t>(reading.clocks.count), 0), delay}));
  return search.records() > 0 ? most_N2 / search.squares_N2() : 0;
}

/// Returns the offsets from the first of the related clocks, after reading the flight with `places_s`.
/// @param places_s from placed_clocks(); clocks within the range of the search are at 0
std::vector<ClockOffset> offsets_beyond(const Reading& reading,
                                        const std::vector<std::optional<double>>& places_s,
                                        double explained_before) {
  ClockSearch search = search_of(reading);
  if (!search.is_rich()) return {};
  Estimate estimate = {search.best(), {}, {}};
  const std::vector<int> around = circle(search, estimate.steps, reading.clocks.count);
  const auto place = [&](int clock) { return places_s[static_cast<std::size_t>(clock)]; };
  const int reference = static_cast<int>(
      std::find_if(places_s.begin(), places_s.end(), [](const auto& one) { return one.has_value(); }) -
      places_s.begin());
  if (std::find(around.begin(), around.end(), reference) == around.end()) return {};
  estimate.offsets_s = search.offsets_s(estimate.steps, -1);
  estimate.without_s = left_out(search, estimate.steps);
  std::vector<ClockOffset> result;
  for (const int clock : around) {
    if (clock == reference || !place(clock)) continue;
    const Suspect suspect = {clock, explained_before * search.squares_N2()};
    ClockOffset found = offset_of(reading.clocks, search, estimate, suspect, reference);
    const double deviation_s = std::abs(found.offset_s) / found.z;
    found.offset_s += *place(clock);
    found.interval = {found.interval.lower + *place(clock), found.interval.upper + *place(clock)};
    found.z = std::abs(found.offset_s) / deviation_s;
    if (found.z > kLeastZ) result.push_back(std::move(found));
  }
  return result;
}

/// Searches all offsets at which the logs overlap. Returns nothing if all related clocks are within the range of the
/// search.
std::vector<ClockOffset> distant_offsets(const residuals::Inputs& inputs, std::size_t flight,
                                         const Reading& reading) {
  const std::vector<double> equal_s(static_cast<std::size_t>(reading.clocks.count), 0.0);
  std::vector<std::optional<double>> places_s =
      placed_clocks(clocked_vehicles(reading, equal_s), reading.clocks.count);
  bool is_beyond = false;
  for (std::optional<double>& place_s : places_s) {
    if (place_s && std::abs(*place_s) < kSearched_s) place_s = 0;
    is_beyond = is_beyond || (place_s && *place_s != 0);
  }
  if (!is_beyond) return {};
  residuals::Inputs placed = inputs;
  for (std::size_t v = 0; v < reading.clocks.tracks.size(); ++v) {
    const Track& track = *reading.clocks.tracks[v];
    const auto& place_s = places_s[static_cast<std::size_t>(reading.clocks.of[v])];
    if (place_s && *place_s != 0)
      placed.found.flights[flight].clock_offsets_s[track.path] = track.clock_offset_s + *place_s;
  }
  return offsets_beyond(read_flight(placed, flight), places_s, explained_if_equal(reading));
}

}  // namespace

std::vector<ClockOffset> clock_offsets(const residuals::Inputs& inputs, int jobs) {
  const std::size_t count = inputs.found.flights.size();
  std::vector<std::vector<ClockOffset>> found(count);
  files::parallel_for(static_cast<int>(count), jobs, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    if (inputs.found.flights[i].logs.size() < 2) return;
    const Reading reading = read_flight(inputs, i);
    if (reading.clocks.count < 2) return;
    found[i] = distant_offsets(inputs, i, reading);
    if (found[i].empty()) found[i] = offsets_of(reading);
  });
  std::vector<ClockOffset> result;
  for (std::vector<ClockOffset>& some : found)
    std::move(some.begin(), some.end(), std::back_inserter(result));
  return result;
}

void correct_clocks(const std::vector<ClockOffset>& offsets, residuals::Inputs& inputs) {
  for (const ClockOffset& offset : offsets) {
    for (residuals::FlightFiles& flight : inputs.found.flights) {
      const bool has_log = std::any_of(flight.logs.begin(), flight.logs.end(),
                                       [&](const auto& log) { return log.second == offset.path; });
      if (has_log) flight.clock_offsets_s[offset.path] = offset.correction_s;
    }
  }
}

std::vector<ClockOffset> find_and_correct_clocks(residuals::Inputs& inputs, int jobs) {
  std::vector<ClockOffset> offsets = clock_offsets(inputs, jobs);
  correct_clocks(offsets, inputs);
  return offsets;
}

std::string in_words(const ClockOffset& offset) {
  const auto log = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  return fmt::format("the clock of {} is {:.3f} s {} that of {} ({:+.3f} .. {:+.3f})", log(offset.path),
                     std::abs(offset.offset_s), offset.offset_s > 0 ? "ahead of" : "behind",
                     offset.logs == 2 ? "the other log" : log(offset.against), offset.interval.lower,
                     offset.interval.upper);
}

}  // namespace swarmcert::identification
