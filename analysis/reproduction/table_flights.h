/// @file The flights behind tab:nnperf: six swaps of two to five vehicles with four controllers, and their errors.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "analysis/reproduction/stages.h"
#include "nn/base/record.h"

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

/// One flight of the table: six swaps.
struct TableFlight {
  int controller = 0, vehicles = 0, training_seed = 0;
  std::uint64_t flight_seed = 0;
  double max_m[3] = {0, 0, 0};                  ///< |x|, |y|, |z|; infinite: vehicle lost
  double p50_m[2] = {0, 0}, p95_m[2] = {0, 0};  ///< of |x|, |y|
  double saturated_share = 0;
};
using TableFlights = std::vector<TableFlight>;

void describe(files::Record& record, const TableFlight& flight);

/// Returns all flights of one training seed; read from `file` if it contains them.
/// @param stages trained the networks, on flights of their own truth.
/// @param flown the truth used in flight; its battery may differ.
TableFlights table_flights(const Setting& setting, Stages& stages, const Truth& flown, int training_seed,
                           double higher_m, const std::string& file);

/// Statistics of one value over the flights of one controller and number of vehicles; a lost flight counts as infinite.
struct Spread {
  double median_m = 0, least_m = 0, most_m = 0;
};
Spread spread_of(const TableFlights& flights, int controller, int vehicles,
                 const std::function<double(const TableFlight&)>& value);

/// Of the height errors, indexed by controller, then by the number of vehicles starting at kLeastVehicles.
using Spreads = std::array<std::array<Spread, 4>, 4>;
Spreads height_spreads(const TableFlights& flights);

}  // namespace swarmcert::reproduction
