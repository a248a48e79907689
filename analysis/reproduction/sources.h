/// @file Training flights shared by several experiments, and networks that differ only in their seeds.
#pragma once

#include <string>
#include <vector>

#include "analysis/reproduction/recorded.h"

namespace swarmcert::reproduction {

/// Training flights, and the options common to all networks.
struct Source {
  std::string name;    ///< "simulated" or "recorded"
  Recorded all, half;  ///< half: half of the flights to fit
  LearnOptions options;
};

/// Returns flights of three vehicles, half of the time in a random walk and half in swaps. `half`: both half as long.
Source simulated_source(const Setting& setting);
/// Returns the published flights. `half`: every other flight to fit of each scenario.
Source recorded_source(const Setting& setting);

/// Measurements of networks that differ only in their seeds, by seed.
struct Group {
  std::vector<double> select_gf, test_gf, bounds;
  double mean_select_gf() const;
  double mean_test_gf() const;
  double mean_bound() const;
};

/// Trains `seeds` networks with tight bounds, small ones at the small size, into folders whose names begin with `name`.
Group train_group(const Setting& setting, const Source& source, const Recorded& flights, LearnOptions options,
                  const std::string& name, int seeds);

/// Describes the numbers of a group, by seed and their means.
void describe_group(files::Record& record, const Group& group);

}  // namespace swarmcert::reproduction
