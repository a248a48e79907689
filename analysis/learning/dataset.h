/// @file Flights as samples for training.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "nn/training/deep_set_loss.h"

namespace swarmcert::learning {

/// What a sample may be used for. Flights are split as wholes: neighbouring records of one flight are nearly the same.
enum class Use { kFit, kSelect, kTest };
const char* name(Use use);

/// Hidden layers and the width H between phi and rho; the paper's are 25, 40, 40 and 40, 40, 40 with H = 40.
struct NetworkSizes {
  std::vector<int> phi = {25, 40, 40};
  std::vector<int> rho = {40, 40, 40};
  int features = 40;
  bool ground = true;  ///< a phi of the vehicle's own height and velocity, always in the sum
};

/// Samples of one vehicle in one flight.
struct TrackSamples {
  std::string flight, scenario, vehicle;
  std::string composition;  ///< kinds of the neighbours, then of the vehicle: "small+small>small"
  Use use = Use::kFit;
  Eigen::Index begin = 0, end = 0;
};

struct LearningData {
  training::Layout layout;  ///< parts "phi:<kind>", with "phi:ground", and "rho:<kind>"
  training::Dataset samples;
  std::vector<TrackSamples> tracks;
  bool split_by_time = false;  ///< too few flights to split by flight: scores inside a flight are too good
  std::vector<std::string> problems;

  std::vector<Eigen::Index> indices(Use use) const;
};

/// Shows progress: flights done of all.
using Progress = std::function<void(int done, int total)>;

/// Loads flights. The target of a sample is what the vehicle's model leaves of the vertical force, in gram-force;
/// inputs are relative positions and velocities of the neighbours in the world frame (paper, section V-B), and own
/// (-z, -v) for the ground. Among the samples to
/// fit, every composition of kinds gets the same total weight; the others have weight 1.
///
/// Split: where `test` has flights, those are the test flights and every fifth of `inputs` selects; else of every five
/// flights, in order of names and runs, one selects and one tests; of three or four flights the last two do; one or two
/// are split by time, 70 : 15 : 15.
/// @param test may be null.
/// @throws files::InputError if no record of a vehicle with a model is left, or none has a neighbour.
LearningData load_learning_data(const residuals::Inputs& inputs, const residuals::Inputs* test,
                                const NetworkSizes& sizes, int jobs, const Progress& progress);

}  // namespace swarmcert::learning
