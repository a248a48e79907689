/// @file Flights that several experiments learn from, and networks that differ in their seeds only.
#pragma once

#include <string>
#include <vector>

#include "analysis/reproduction/recorded.h"

namespace swarmcert::reproduction {

/// Flights that are learned from, and the options that are common to all networks.
struct Source {
  std::string name;    ///< "simulated" or "recorded"
  Recorded all, half;  ///< half: of those to fit
  LearnOptions options;
};

/// Three vehicles, half of the time in a random walk, half in swaps. Half of the flights: both half as long.
Source simulated_source(const Setting& setting);
/// The published flights. Half of them: every other flight to fit of each scenario.
Source recorded_source(const Setting& setting);

/// What was measured of networks that differ in their seeds only, by seed.
struct Group {
  std::vector<double> select_gf, test_gf, bounds;
  double mean_select_gf() const;
  double mean_test_gf() const;
  double mean_bound() const;
  /// Standard error of the mean, over seeds; NaN of one.
  double standard_error_gf() const;
};

/// Trains `seeds` networks with tight bounds, small ones at the small size, into folders that begin with `name`.
Group train_group(const Setting& setting, const Source& source, const Recorded& flights, LearnOptions options,
                  const std::string& name, int seeds);

files::Json json_of(const Group& group);

}  // namespace swarmcert::reproduction
