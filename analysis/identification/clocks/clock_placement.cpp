#include "analysis/identification/clocks/clock_placement.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::identification {
namespace {

/// Returns the vehicles whose clocks are placed or `next`, at their places.
std::vector<ClockedVehicle> vehicles_at(const std::vector<ClockedVehicle>& vehicles,
                                        const std::vector<std::optional<double>>& places_s, int next) {
  std::vector<ClockedVehicle> chosen;
  for (ClockedVehicle vehicle : vehicles) {
    const std::optional<double>& place_s = places_s[static_cast<std::size_t>(vehicle.clock)];
    if (!place_s && vehicle.clock != next) continue;
    vehicle.ahead_s = place_s.value_or(0);
    chosen.push_back(vehicle);
  }
  return chosen;
}

struct Placement {
  int first = -1, second = -1;  ///< `second` is placed relative to `first`
  ClockPeak peak;
};

Placement best_pair(const std::vector<ClockedVehicle>& vehicles, int clocks) {
  Placement best;
  for (int a = 0; a < clocks; ++a) {
    for (int b = a + 1; b < clocks; ++b) {
      std::vector<std::optional<double>> places_s(static_cast<std::size_t>(clocks));
      places_s[static_cast<std::size_t>(a)] = 0;
      const ClockPeak peak = clock_peak(vehicles_at(vehicles, places_s, b), b, 0);
      if (best.first < 0 || peak.chance < best.peak.chance) best = {a, b, peak};
    }
  }
  return best;
}

}  // namespace

bool is_related(const std::vector<ClockedVehicle>& vehicles, int clock, double delay_s, double expected_s) {
  const ClockPeak peak = clock_peak(vehicles, clock, delay_s);
  return peak.chance < kMostChance && std::abs(peak.ahead_s - expected_s) <= kSearched_s;
}

std::vector<std::optional<double>> placed_clocks(std::vector<ClockedVehicle> vehicles, int clocks) {
  std::vector<std::optional<double>> places_s(static_cast<std::size_t>(clocks));
  const Placement start = best_pair(vehicles, clocks);
  const int pairs = clocks * (clocks - 1) / 2;
  if (!(start.peak.chance * pairs < kMostChanceAnywhere)) return {};
  places_s[static_cast<std::size_t>(start.first)] = 0;
  places_s[static_cast<std::size_t>(start.second)] = start.peak.ahead_s;
  for (int placed = 2; placed < clocks; ++placed) {
    Placement next;
    for (int k = 0; k < clocks; ++k) {
      if (places_s[static_cast<std::size_t>(k)]) continue;
      const ClockPeak peak = clock_peak(vehicles_at(vehicles, places_s, k), k, 0);
      if (next.second < 0 || peak.chance < next.peak.chance) next = {start.first, k, peak};
    }
    if (!(next.peak.chance * (clocks - placed) < kMostChanceAnywhere)) break;
    places_s[static_cast<std::size_t>(next.second)] = next.peak.ahead_s;
  }
  // Relative to the first of them.
  const auto first =
      std::find_if(places_s.begin(), places_s.end(), [](const auto& place) { return place.has_value(); });
  const double zero_s = first->value();
  for (std::optional<double>& place_s : places_s)
    if (place_s) *place_s -= zero_s;
  return places_s;
}

}  // namespace swarmcert::identification
