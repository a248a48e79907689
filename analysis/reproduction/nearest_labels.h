/// @file The error that no function of the relative states can remove, estimated from other flights at the same states.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "analysis/learning/dataset.h"

namespace swarmcert::reproduction {

/// Labels of one vehicle in one test flight, minus those of the nearest records of the fitted and selecting flights.
struct NearestLabels {
  double mean_gf = 0, rms_gf = 0;
};

/// Returns the statistics by flight and vehicle, for test tracks of vehicles alone or with one neighbour. Every
/// twentieth record is compared with the mean label of the twenty nearest of every fifth record with the same
/// composition of kinds. Near means a difference of about 5 cm in lateral distance and height and 0.25 m/s in the
/// velocity components that are invariant under rotation about the vertical. Tracks in which fewer than 90 % of the
/// records have near ones are left out, as are tracks with more neighbours, because nothing is near in so many
/// dimensions.
std::map<std::pair<std::string, std::string>, NearestLabels> nearest_labels(
    const learning::LearningData& data);

}  // namespace swarmcert::reproduction
