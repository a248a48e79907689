/// @file Decides which clocks of a flight are related, and places those outside of the range of ClockSearch.
#pragma once

#include <optional>
#include <vector>

#include "analysis/identification/clocks/clock_relation.h"

namespace swarmcert::identification {

/// Range of the search, in either direction.
inline constexpr double kSearched_s = kClockSteps * kClockStep_s;
/// Largest ClockPeak::chance of an offset within the range of the search, which has its own tests.
inline constexpr double kMostChance = 0.02;
/// The same for offsets of any size. Only this test stands behind them, and clocks are rarely seconds apart.
inline constexpr double kMostChanceAnywhere = 0.001;

/// Returns whether the offset of `clock` stands out from its rivals, and lies within the range of the search of
/// `expected_s`.
/// @param vehicles the others with offsets that were estimated without `clock`
bool is_related(const std::vector<ClockedVehicle>& vehicles, int clock, double delay_s, double expected_s);

/// Returns how far each clock is ahead of the first of the related ones, in steps of 40 ms; nothing for the others.
/// Starts with the pair of clocks whose offset stands out most and adds the others one by one. Empty if no pair does.
std::vector<std::optional<double>> placed_clocks(std::vector<ClockedVehicle> vehicles, int clocks);

}  // namespace swarmcert::identification
