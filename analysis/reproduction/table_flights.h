/// @file The flights behind tab:nnperf: six swaps of two to five vehicles with four controllers, and their errors.
#pragma once

#include <array>
#include <limits>
#include <string>

#include "analysis/reproduction/stages.h"

namespace swarmcert::reproduction {

/// Offset of the swaps above the published heights. There the lowest of five vehicles flies at 0.3 m, and an error of
/// the size reported in the paper would end on the floor.
inline constexpr double kHigher_m = 0.3;

inline constexpr int kLeastVehicles = 2, kMostVehicles = 5;
inline constexpr std::array<int, 4> kControllers = {0, 2, 3, 4};  ///< "trained with"; 0: the baseline

/// tab:nnperf, m, by controller and by number of vehicles; NaN: not flown.
inline constexpr double kPaper_m[4][4] = {{0.094, 0.139, 0.209, 0.314},
                                          {0.027, 0.150, 0.294, std::numeric_limits<double>::quiet_NaN()},
                                          {0.026, 0.082, 0.140, 0.159},
                                          {0.024, 0.061, 0.102, 0.150}};

/// Returns all flights of one training seed as objects of result.json; read from `file` if it contains them.
/// @param stages trained the networks, on flights of their own truth.
/// @param flown the truth used in flight; its battery may differ.
files::Json table_flights(const Setting& setting, Stages& stages, const Truth& flown, int training_seed,
                          double higher_m, const std::string& file);

/// Statistics of one field over the flights of one controller and number of vehicles; a lost flight counts as infinite.
struct Spread {
  double median_m = 0, least_m = 0, most_m = 0;
};
Spread spread_of(const files::Json& flights, int controller, int vehicles, const char* field);

/// Indexed by controller, then by the number of vehicles starting at kLeastVehicles.
using Spreads = std::array<std::array<Spread, 4>, 4>;
Spreads height_spreads(const files::Json& flights);

}  // namespace swarmcert::reproduction
