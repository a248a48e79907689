/// @file Error that no function of the relative states can explain,
/// estimated from other flights at the same states.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "analysis/learning/dataset.h"

namespace swarmcert::reproduction {

/// Labels of one vehicle in one test flight, less those of the nearest records of the flights that fit and select.
struct NearestLabels {
  double mean_gf = 0, rms_gf = 0;
};

/// Of test tracks of vehicles alone or with one neighbour, by flight and vehicle. Every twentieth record is compared
/// with the mean label of the twenty nearest of every fifth record of the same composition of kinds; near is what
/// differs by about 5 cm in lateral distance and height and 0.25 m/s in the velocities that a turn about the vertical
/// leaves alone. Tracks of which fewer than nine in ten records have near ones are left out, as are those with more
/// neighbours: nothing is near in so many dimensions.
std::map<std::pair<std::string, std::string>, NearestLabels> nearest_labels(
    const learning::LearningData& data);

}  // namespace swarmcert::reproduction
